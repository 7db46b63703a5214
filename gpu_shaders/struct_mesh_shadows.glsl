// The lights' shadow maps of meshes. Filled by addon/render/mesh_shadows.py.
struct MeshShadows {
  vec4 map_x[{{mesh_frame_capacity}}];  // rows that take (world position, 1) to x, y, depth and w of
  vec4 map_y[{{mesh_frame_capacity}}];  // each map, see mesh_frames.py
  vec4 map_w[{{mesh_frame_capacity}}];
  vec4 map_depth[{{mesh_frame_capacity}}];
  vec4 light[{{light_capacity}}];       // x index of each light's first map, y number of its maps
  vec2 shift;                           // of the look-ups in this sample [texels]
  float resolution;
  float none;
};
