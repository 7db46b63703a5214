// Signed distance of a point to posed colliders and the direction out, for all shaders but the solver's.
//
// Twin of addon/dynamics/colliders/signed_distance.py. Needs the textures `solids`, and `rounds` with
// HAS_ROUNDS and `fields` with HAS_FIELDS, see render/collider_textures.py. With HAS_SEVERAL the integer
// `solid_count` is the number of colliders, else there is one: software drivers execute a loop once even if
// its condition is false.
#include "lib_collider.glsl"

vec4 solid_texel(int solid, int texel)
{
  return texelFetch(solids, ivec2(solid * {{collider_texels}} + texel, 0), 0);
}

// A collider in its current pose.
struct Solid {
  vec4 to_local[3];  // rows of the matrix to its own space
  vec4 sphere;       // around it
  vec4 shape;        // see collider_distance
  vec4 grid_origin;
};

Solid solid_at(int number)
{
  Solid solid;
  for (int row = 0; row < 3; row++) {
    solid.to_local[row] = solid_texel(number, row);
  }
  solid.shape = solid_texel(number, 6);
  solid.grid_origin = solid_texel(number, 7);
  solid.sphere = solid_texel(number, 8);
  return solid;
}

// The result of signed_distance, updated with one more collider.
vec4 nearer_of(vec4 result, Solid solid, vec3 point)
{
  if (distance(solid.sphere.xyz, point) - solid.sphere.w >= result.w) {
    return result;
  }
  vec4 here = vec4(point, 1.0);
  vec4 rows[3] = solid.to_local;
  vec3 local = vec3(dot(rows[0], here), dot(rows[1], here), dot(rows[2], here));
  SignedDistance found = collider_distance(solid.shape, solid.grid_origin, local);
  vec3 normal = rows[0].xyz * found.gradient.x + rows[1].xyz * found.gradient.y +
                rows[2].xyz * found.gradient.z;
  float size = max(length(normal), 1.0e-12);
  // where two sides of the collider are equally near, a sampled gradient is short
  float stretch = max({{min_gradient}} / max(length(found.gradient), 1.0e-12), 1.0);
  float away = found.distance / (size * stretch);
  return away < result.w ? vec4(normal / size, away) : result;
}

// w: the signed distance [m] of a world-space point to the nearest collider, negative inside, at most
// `reach`. xyz: unit direction outwards, zero where no collider is nearer than `reach`.
//
// `first`: solid_at(0), fetched once for many points; there is at least one collider.
vec4 signed_distance(Solid first, vec3 point, float reach)
{
  vec4 result = nearer_of(vec4(0.0, 0.0, 0.0, reach), first, point);
#ifdef HAS_SEVERAL
  for (int solid = 1; solid < solid_count; solid++) {
    result = nearer_of(result, solid_at(solid), point);
  }
#endif
  return result;
}
