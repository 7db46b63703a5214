// The camera and its target. Filled by addon/render/view_block.py.
struct View {
  mat4 view_projection;
  mat4 projection;
  vec4 eye;       // xyz position and w 1, or xyz direction towards the eye and w 0 (orthographic)
  vec4 viewport;  // xy size of the target in pixels, z index of the sample
};
