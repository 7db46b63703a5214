// What is in the way of a light to a card: all but the card itself, which is in the maps as well.
//
// Twin of among_strands in addon/shading/volume/card_opacity.py. Reads what lib_shadows.glsl reads.
#include "lib_shadows.glsl"
#include "lib_card_opacity.glsl"

// As shadow_path, for a place of a card whose texture covers alpha. `across`: normal of its plane, of any
// length. VIEW_COMPENSATED: for the foremost of its strands.
vec3 shadow_path_to_card(
    int index, vec3 point, float alpha, vec3 to_light, vec3 across, vec3 tangent, vec3 normal)
{
  vec3 path = shadow_path(index, point);
#if SHADOWS
  if (path.x >= 0.0) {
    float fraction = own_fraction(index, point), tau = card_optical_depth(alpha);
    float scale = opacity.extinction * card_thickness;
#  if VIEW_COMPENSATED
    scale *= view_compensated_depth(across, tangent, to_light);
    path.xy = among_strands(path.xy, scale, tau, fraction, 0.5 + 0.5 * dot(normal, to_light));
#  else
    path.x = max(path.x - scale * fraction * tau, 0.0);
#  endif
  }
#endif
  return path;
}
