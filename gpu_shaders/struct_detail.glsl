// What detail depends on besides its settings. Filled by addon/render/detail_pass.py.
struct DetailView {
  mat4 view_projection;
  vec4 eye;      // as in View
  vec4 picture;  // xy pixels from the middle of the final picture to its edges, w half a strand's width
                 // in pixels of a radius and a depth of 1
  vec4 center;   // xyz the middle of all roots, w number of shades
  vec4 shades[3 * {{shade_capacity}}];  // three each, see lib_culling.glsl
};
