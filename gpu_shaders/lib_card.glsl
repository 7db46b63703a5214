// What a card makes of the models of strands: a card stands for many of them.
//
// Twin of addon/shading/card_look.py: same names, same order. Holds no resources.
#include "lib_card_opacity.glsl"
#include "lib_kajiya_kay.glsl"

// The way of a strand by a texel of a tangent map.
vec3 mapped_tangent(vec3 texel, vec3 tangent, vec3 normal, float shift_noise)
{
  vec3 direction = 2.0 * texel - 1.0;
  vec3 side = cross(tangent, normal);
  vec3 strand = direction.x * side + direction.y * tangent + direction.z * (shift_noise * normal);
  return unit_or(strand, tangent);
}

// The normal by a texel of a normal map.
vec3 mapped_normal(vec3 texel, vec3 tangent, vec3 normal)
{
  vec3 direction = 2.0 * texel - 1.0;
  vec3 side = cross(tangent, normal);
  return unit_or(direction.x * side + direction.y * tangent + direction.z * normal, normal);
}

// What a card covers that is seen at a slant, if alpha is what it covers on the mean of all turns about
// its strands. `across`: normal of its plane, of any length.
float view_compensated_alpha(float alpha, vec3 across, vec3 tangent, vec3 to_eye)
{
  float facing = hair_facing(across, tangent, to_eye);
  return 1.0 - pow(1.0 - alpha, {{mean_facing}} / max(facing, {{min_facing}}));
}

// Mean colour of the strands, of which some are grey: times the base texture it is the hair's.
vec3 card_base(float along, ShadingSettings shading)
{
  vec3 colored = strand_base(along, 0.5, 1.5, shading, shading.base_color);
  vec3 grey = strand_base(along, 0.5, -0.5, shading, shading.base_color);
  return mix(colored, grey, shading.grey_fraction);
}

// The absorption of strands whose colour is `base` times that of the card's mean. `color_factor`: by
// which a root of absorption is minus the logarithm of a colour.
vec3 own_absorption(vec3 absorption, vec3 base, float color_factor)
{
  vec3 root = sqrt(max(absorption, 0.0)) - log(max(base, {{darkest}})) / color_factor;
  root = max(root, 0.0);
  return root * root;
}
