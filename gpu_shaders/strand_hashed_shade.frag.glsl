// Hashed strands, second step: the colours of what both turns have found, where they have, and its depth.
#include "lib_layer_radiance.glsl"
#include "lib_output.glsl"

// w the depth; beyond all depths where there is no hair.
vec4 shaded(vec4 hair)
{
  if (hair.w == 0.0) {
    return vec4(0.0, 0.0, 0.0, 2.0);
  }
  vec3 light = layer_radiance(int(hair.x), hair.y);
  return vec4(output_encoded(light, output_encoding), hair.z);
}

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 one = texelFetch(first_hair, pixel, 0), other = texelFetch(second_hair, pixel, 0);
  if (one.w == 0.0 && other.w == 0.0) {
    discard;
  }
  first_light = shaded(one);
  second_light = shaded(other);
}
