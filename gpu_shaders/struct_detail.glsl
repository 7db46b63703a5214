// The view for which detail factors are computed. Filled by addon/render/detail_pass.py.
struct DetailView {
  mat4 view_projection;
  vec4 eye;      // as in View
  vec4 picture;  // xy half the size of the final picture [pixels], w half the width of a strand with radius
                 // 1 at depth 1 [pixels]
  vec4 center;   // xyz the mean of all roots, w number of hidden regions
  vec4 hidden_regions[3 * {{hidden_region_capacity}}];  // three vectors each, see lib_culling.glsl
};
