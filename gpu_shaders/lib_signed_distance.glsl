// How far a point is from posed colliders, and which way leads out: for whoever is not the solver.
//
// Twin of addon/dynamics/colliders/signed_distance.py. Needs the integer `solid_count`, and the
// textures `solids`, `rounds` and `fields`, see render/collider_textures.py; HAS_ROUNDS and
// HAS_FIELDS say which of the latter there are.
#include "lib_collider.glsl"

vec4 solid_texel(int solid, int texel)
{
  return texelFetch(solids, ivec2(solid * {{collider_texels}} + texel, 0), 0);
}

// w: the signed distance [m] of a point of the world to the nearest collider, negative inside,
// `reach` where nothing is nearer. xyz: unit direction outwards, zero where nothing is nearer.
vec4 signed_distance(vec3 point, float reach)
{
  vec4 result = vec4(0.0, 0.0, 0.0, reach);
  for (int solid = 0; solid < solid_count; solid++) {
    vec4 sphere = solid_texel(solid, 8);  // around the collider
    if (distance(sphere.xyz, point) - sphere.w >= result.w) {
      continue;
    }
    vec4 rows[3];
    for (int row = 0; row < 3; row++) {
      rows[row] = solid_texel(solid, row);
    }
    vec4 here = vec4(point, 1.0);
    vec3 local = vec3(dot(rows[0], here), dot(rows[1], here), dot(rows[2], here));
    Found found = distance_to(solid_texel(solid, 6), solid_texel(solid, 7), local);
    vec3 normal = rows[0].xyz * found.gradient.x + rows[1].xyz * found.gradient.y +
                  rows[2].xyz * found.gradient.z;
    float size = max(length(normal), 1.0e-12);
    // two sides of the collider may be as near; then a sampled gradient is short
    float stretch = max({{flattest}} / max(length(found.gradient), 1.0e-12), 1.0);
    float away = found.distance / (size * stretch);
    if (away < result.w) {
      result = vec4(normal / size, away);
    }
  }
  return result;
}
