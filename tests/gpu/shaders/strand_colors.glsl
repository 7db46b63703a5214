// places: along, colour noise, grey noise. Row 0 strand_absorption, 1 strand_color of it,
// 2 strand_base with tip_fraction in w.
#include "lib_marschner.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  vec3 place = texelFetch(places, ivec2(at.x, 0), 0).xyz;
  vec3 absorption = strand_absorption(fibre, place.x, place.y, place.z, shading, fibre.root.xyz);
  vec3 base = strand_base(place.x, place.y, place.z, shading, shading.base_color);
  vec3 value = at.y == 0 ? absorption : at.y == 1 ? strand_color(fibre, absorption) : base;
  imageStore(result, at, vec4(value, tip_fraction(place.x, shading)));
}
