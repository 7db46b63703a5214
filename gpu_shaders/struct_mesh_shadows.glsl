// The lights' maps of the depths of meshes. Filled by addon/render/mesh_shadows.py.
struct MeshShadows {
  vec4 map_x[{{mesh_frame_capacity}}];  // rows that take (world position, 1) to x, y, depth and w of
  vec4 map_y[{{mesh_frame_capacity}}];  // each map, see mesh_frames.py
  vec4 map_w[{{mesh_frame_capacity}}];
  vec4 map_depth[{{mesh_frame_capacity}}];
  vec4 light[{{light_capacity}}];       // x number of each light's first map, y how many it has
  vec2 shift;                           // of the texels that are asked
  float resolution;
  float none;
};
