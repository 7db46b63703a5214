// What is in the way of a light to a card: all but the card itself, which is in the maps as well.
//
// Twin of own_fraction and among_strands in addon/shading/volume/card_opacity.py. Reads what lib_shadows.glsl reads.
#include "lib_shadows.glsl"
#include "lib_card_opacity.glsl"

#if SHADOWS
// How much of a card at a point counts towards tau there, since tau grows evenly through the layer
// in which the card lies.
float own_fraction(int light, vec3 point)
{
  vec3 place = map_place(opacity, light, point);
  float depth = min(place.z, 1.0), bias = opacity.bias;
#  if DEEP
  ivec2 texel_at = clamp(ivec2(place.xy * float(opacity.resolution)), 0, opacity.resolution - 1);
  vec2 span = layer_span(
      opacity_starts, texel_at, int(opacity.light[light].x), opacity.resolution);
  depth = min((depth - span.x) * span.y, 1.0);
  bias *= span.y;
#  endif
  float before = 0.0;
  for (int texel = 0; texel < opacity.layer_texels; texel++) {
    for (int lane = 0; lane < 4; lane++) {
      float end = opacity.ends[texel][lane];
      if (depth <= end) {
        return clamp((depth - bias - before) / (end - before), 0.0, 1.0);
      }
      before = end;
    }
  }
  return 0.0;
}
#endif

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
