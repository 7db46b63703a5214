#include "lib_card_opacity.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  vec3 across = texelFetch(normals, pixel, 0).xyz;
  float facing = layer_facing(
      across, texelFetch(tangents, pixel, 0).xyz, texelFetch(eyes, pixel, 0).xyz);
  imageStore(result, pixel, vec4(facing));
}
