// The lights' opacity maps. Filled by addon/render/opacity_maps.py.
struct Opacity {
  vec4 map_x[{{light_capacity}}];      // rows that take (world position, 1) to x, y, depth and w of
  vec4 map_y[{{light_capacity}}];      // each light's map, see light_frame.py
  vec4 map_w[{{light_capacity}}];
  vec4 map_depth[{{light_capacity}}];
  vec4 light[{{light_capacity}}];      // x index of the light's map, -1 for none
  vec4 ends[{{layer_texel_capacity}}]; // of the layers, four to a texel
  float extinction;
  float bias;
  int layer_texels;
  int resolution;
};
