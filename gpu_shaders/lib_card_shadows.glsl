// Shadows on a card from everything but the card itself, which is in the opacity maps as well.
//
// Reads the same resources as lib_shadows.glsl.
#include "lib_shadows.glsl"
#include "lib_card_opacity.glsl"

// As shadow_path, for a place of a card with this alpha. `across`: normal of its plane, of any length.
// VIEW_COMPENSATED: the path ends at the visible one of the strands, which fill a depth [m] about the plane;
// depth 0 means short hair. deeper: how much deeper it lies than visible strands on average, as a fraction
// of that depth.
vec3 shadow_path_to_card(int index,
                         vec3 point,
                         float alpha,
                         vec3 to_light,
                         vec3 to_eye,
                         vec3 across,
                         vec3 tangent,
                         float depth,
                         float deeper)
{
#if !SHADOWS
  return shadow_path(index, point);
#else
  float tau = card_optical_depth(alpha), light_tau = opacity.extinction * card_thickness * tau;
  vec3 strand = point;
#  if VIEW_COMPENSATED
  float eye_tau = light_tau * view_compensated_depth(across, tangent, to_eye);
  light_tau *= view_compensated_depth(across, tangent, to_light);
  vec3 front = across / max(length(across), 1.0e-30) * (dot(across, to_eye) < 0.0 ? -1.0 : 1.0);
  strand += depth * (0.5 - visible_depth(eye_tau)) * front;
#  endif
  vec3 path = shadow_path(index, strand);
  if (path.x >= 0.0) {
    float fraction = self_fraction(index, point, strand);
#  if VIEW_COMPENSATED
    float facing = dot(front, to_light);
    float bias = opacity.bias / length(opacity.map_depth[index].xyz);
    float near = bias * max(abs(facing), {{min_facing}}) / max(depth, {{min_depth}});
    float ahead = clamp(0.5 + {{sidedness}} * facing, 0.0, 1.0);
    vec2 others = tau_within_short_hair(light_tau, tau, ahead);
    if (depth > 0.0) {
      others = tau_within_card_at_depth(
          tau_within_card(eye_tau, light_tau, near, ahead), deeper, ahead);
    }
    path.xy = others + max(path.xy - light_tau * vec2(fraction, 1.0 - fraction), 0.0);
#  else
    path.x = max(path.x - fraction * light_tau, 0.0);
#  endif
  }
  return path;
#endif
}
