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

Found distance_to_solid(int solid, vec3 local)
{
  vec4 own = solid_texel(solid, 6);
  Found found = Found(1.0e30, vec3(0.0));
#ifdef HAS_FIELDS
  if (own.w >= 0.0) {
    vec4 low_cell = solid_texel(solid, 7);
    found = distance_in(Field(low_cell.xyz, low_cell.w, ivec3(own.xyz), int(own.w)), local);
  }
#endif
#ifdef HAS_ROUNDS
  if (own.w < 0.0) {
    vec4 nearest = vec4(0.0);  // xyz from the axis, w radius
    int end = int(own.x + own.y);
    for (int k = int(own.x); k < end; k++) {
      Round round_solid = round_at(k);
      vec3 outward = outward_of(round_solid, local);
      float away = length(outward) - round_solid.radius;
      nearest = away < found.distance ? vec4(outward, round_solid.radius) : nearest;
      found.distance = min(away, found.distance);
    }
    found = distance_from(nearest.xyz, nearest.w);
  }
#endif
  return found;
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
    Found found = distance_to_solid(solid, vec3(dot(rows[0], here), dot(rows[1], here), dot(rows[2], here)));
    vec3 normal = rows[0].xyz * found.gradient.x + rows[1].xyz * found.gradient.y +
                  rows[2].xyz * found.gradient.z;
    float unscaled = 1.0 / max(length(normal), 1.0e-12);
    if (found.distance * unscaled < result.w) {
      result = vec4(normal * unscaled, found.distance * unscaled);
    }
  }
  return result;
}
