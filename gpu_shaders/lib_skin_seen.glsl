// The skin that a place of hair sees. Twin of addon/shading/skin_seen.py, which explains the terms: same
// names. Holds no resources.

// received: light reflected by far skin, as a mean over directions of the light and a vector. beneath: mean
// normal of the skin right beneath. depth: optical depth of the hair between the place and far skin.
struct SkinSeen {
  vec4 received;
  vec3 beneath;
  float depth;
};

// Only skin right beneath, as for hair on a plane.
SkinSeen plane_beneath(vec3 normal)
{
  return SkinSeen(vec4(0.0), normal, 0.0);
}

// The fraction of a light that arrives from far skin, through hair that absorbs the fraction
// {{absorbed_fraction}}.
float far_skin_light(vec4 received, vec3 to_light)
{
  float size = length(received.yzw);
  float uniform_part = max(1.0 - 0.5 * size / max(received.x, 1.0e-6), 0.0);
  float facing = max(dot(received.yzw, to_light), 0.0) / max(size, 1.0e-6);
  return received.x * (uniform_part + (1.0 - uniform_part) * 4.0 * facing);
}

// Transmittance of hair with gaps whose strands absorb the fraction `absorbed`, over that at
// {{absorbed_fraction}}, for which `received` holds. At the edge of a card the depth may be extrapolated
// beyond its vertices.
vec3 through_hair(float depth, vec3 absorbed)
{
  float clumped = {{clumping}} * max(depth, 0.0);
  return pow((1.0 + clumped * absorbed) / (1.0 + clumped * {{absorbed_fraction}}), vec3(-1.0 / {{clumping}}));
}

// A vector from its components along a strand or card, along its normal, and across both.
vec3 from_axes(vec3 parts, vec3 tangent, vec3 normal)
{
  return tangent * parts.x + normal * parts.y + cross(tangent, normal) * parts.z;
}
