// places: along, colour noise, grey noise; roots: own colours. Row 0: strand_absorption, 1: its strand_color,
// 2: strand_base with tip_fraction in w; 3 and 4: rows 0 and 2 for strands with their own colours.
#include "lib_marschner.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  vec3 place = texelFetch(places, ivec2(at.x, 0), 0).xyz;
  vec3 own = texelFetch(roots, ivec2(at.x, 0), 0).xyz;
  bool is_own = at.y > 2;
  vec3 absorbing = is_own ? color_absorption(fibre, own) : fibre.root.xyz;
  vec3 absorption = strand_absorption(fibre, place.x, place.y, place.z, shading, absorbing);
  vec3 root = is_own ? own : shading.base_color;
  vec3 base = strand_base(place.x, place.y, place.z, shading, root);
  vec3 value = at.y % 3 == 0 ? absorption : at.y == 1 ? strand_color(fibre, absorption) : base;
  imageStore(result, at, vec4(value, tip_fraction(place.x, shading)));
}
