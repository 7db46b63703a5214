// Rotations of guides as quaternions, w last.
//
// Twin of minimal_rotation and turn_change in addon/refine/ride.py. Holds no resources.
#include "lib_unit.glsl"

// The change of a vector when a quaternion of any length rotates it.
vec3 turn_change(vec4 turn, vec3 vector)
{
  vec3 across = cross(turn.xyz, vector);
  return (turn.w * across + cross(turn.xyz, across)) * (2.0 / dot(turn, turn));
}

// The quaternion that turns by `right` first, then by `left`.
vec4 turn_product(vec4 left, vec4 right)
{
  return vec4(left.w * right.xyz + right.w * left.xyz + cross(left.xyz, right.xyz),
              left.w * right.w - dot(left.xyz, right.xyz));
}

// Unit vector along an edge, or 0 where it has no length.
vec3 direction_of(vec3 edge)
{
  float size = length(edge);
  return size < {{min_segment_length}} ? vec3(0.0) : edge / size;
}

// The smallest rotation from one unit vector to another; the identity where either is zero. Computed from
// their difference, so that it is exactly the identity for equal vectors.
vec4 minimal_rotation(vec3 one, vec3 other)
{
  if (one == vec3(0.0) || other == vec3(0.0)) {
    return vec4(0.0, 0.0, 0.0, 1.0);
  }
  vec3 change = other - one;
  vec4 turn = vec4(cross(one, change), 2.0 - 0.5 * dot(change, change));
  if (turn.w < {{reversal_limit}}) {
    turn = vec4(cross(one, axis_across(one)), 0.0);
  }
  return turn / sqrt(dot(turn, turn));
}
