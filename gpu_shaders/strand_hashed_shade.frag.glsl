// Hashed strands, second step: colour and depth of the fragments that both turns have found.
//
// SHADES_ALL: pixels without hair are shaded as well and then ignored, for a driver that fails in a branch
// that no pixel takes.
#include "lib_layer_radiance.glsl"
#include "lib_output.glsl"

bool is_bare(vec4 hair)
{
  return hair.w == 0.0;
}

// w the depth; beyond all depths where there is no hair.
vec4 shaded(vec4 hair)
{
  const vec4 nothing = vec4(0.0, 0.0, 0.0, 2.0);
#if !SHADES_ALL
  if (is_bare(hair)) {
    return nothing;
  }
#endif
  vec3 light = layer_radiance(int(hair.x), hair.y);
  return is_bare(hair) ? nothing : vec4(output_encoded(light, output_encoding), hair.z);
}

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 first = texelFetch(first_hair, pixel, 0), second = texelFetch(second_hair, pixel, 0);
#if !SHADES_ALL
  if (is_bare(first) && is_bare(second)) {
    discard;
  }
#endif
  first_light = shaded(first);
  second_light = shaded(second);
}
