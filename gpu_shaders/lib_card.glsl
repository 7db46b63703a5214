// The shading models of strands applied to a card, which represents many strands.
//
// Twin of addon/shading/card_look.py: same names, same order. Holds no resources.
#include "lib_card_opacity.glsl"
#include "lib_kajiya_kay.glsl"

// Direction of the strand at a texel of a tangent map.
vec3 mapped_tangent(vec3 texel, vec3 tangent, vec3 normal, float shift_noise)
{
  vec3 direction = 2.0 * texel - 1.0;
  vec3 side = cross(tangent, normal);
  vec3 strand = direction.x * side + direction.y * tangent + direction.z * (shift_noise * normal);
  return unit_or(strand, tangent);
}

// Normal at a texel of a normal map.
vec3 mapped_normal(vec3 texel, vec3 tangent, vec3 normal)
{
  vec3 direction = 2.0 * texel - 1.0;
  vec3 side = cross(tangent, normal);
  return unit_or(direction.x * side + direction.y * tangent + direction.z * normal, normal);
}

// Coverage of a card seen at a slant. alpha: its coverage on average over all rotations about its strands.
// `across`: normal of its plane, of any length.
float view_compensated_alpha(float alpha, vec3 across, vec3 tangent, vec3 to_eye)
{
  float facing = hair_facing(across, tangent, to_eye);
  return 1.0 - pow(1.0 - alpha, {{mean_facing}} / max(facing, {{min_facing}}));
}

// Mean colour of the strands, some of them grey; times the base texture it is the hair's colour.
vec3 card_base(float along, ShadingSettings shading)
{
  vec3 colored = strand_base(along, 0.5, 1.5, shading, shading.base_color);
  vec3 grey = strand_base(along, 0.5, -0.5, shading, shading.base_color);
  return mix(colored, grey, shading.grey_fraction);
}

// Absorption of strands whose colour is `base` times the card's mean colour, whose absorption is given.
// color_factor: -log(colour) over the square root of absorption.
vec3 own_absorption(vec3 absorption, vec3 base, float color_factor)
{
  vec3 root = sqrt(max(absorption, 0.0)) - log(max(base, {{darkest}})) / color_factor;
  root = max(root, 0.0);
  return root * root;
}
