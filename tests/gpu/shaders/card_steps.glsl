#include "lib_card_texture.glsl"
#include "lib_card.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  vec4 across = texelFetch(normals, pixel, 0);  // w alpha
  float even = even_alpha(
      across.w, across.xyz, texelFetch(tangents, pixel, 0).xyz, texelFetch(eyes, pixel, 0).xyz);
  vec4 steps = texelFetch(steps_of, pixel, 0);
  ivec2 size = ivec2(96, 40);
  imageStore(result, pixel, vec4(even, wanted_level(steps.xy, steps.zw, size), 0.0, 0.0));
}
