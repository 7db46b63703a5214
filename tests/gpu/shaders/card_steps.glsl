#include "lib_card_texture.glsl"
#include "lib_card.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  vec4 across = texelFetch(normals, pixel, 0);  // w alpha
  float even = view_compensated_alpha(
      across.w, across.xyz, texelFetch(tangents, pixel, 0).xyz, texelFetch(eyes, pixel, 0).xyz);
  vec4 steps = texelFetch(steps_of, pixel, 0);
  ivec2 size = ivec2(96, 40);
  float light_tau = card_optical_depth(across.w) *
              view_compensated_depth(
                  across.xyz, texelFetch(tangents, pixel, 0).xyz, texelFetch(eyes, pixel, 0).xyz);
  vec2 tau_within = tau_within_card(steps.x, light_tau, steps.y, min(steps.z, 1.0));
  tau_within = tau_within_card_at_depth(tau_within, 2.0 * min(steps.w, 1.0) - 1.0, min(steps.z, 1.0));
  tau_within += visible_depth(steps.x) +
           tau_within_short_hair(light_tau, card_optical_depth(across.w), min(steps.w, 1.0));
  imageStore(result, pixel, vec4(even, wanted_level(steps.xy, steps.zw, size), tau_within));
}
