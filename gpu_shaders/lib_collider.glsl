// Signed distance to a collider in its own object space, and its gradient.
//
// Twin of shapes.py, sphere_set.py and distance_field.py in addon/dynamics/colliders. Defines:
// HAS_ROUNDS, HAS_FIELDS. Needs the textures `rounds` and `fields`, see
// addon/render/collider_textures.py.

struct SignedDistance {
  float distance;  // [m], negative inside
  vec3 gradient;
};

#ifdef HAS_ROUNDS
struct Round {
  vec3 start;
  float radius;
  vec3 axis;             // from start to end
  float inverse_square;  // of the axis' length, 0 for a ball
};

Round round_at(int index)
{
  ivec2 texel = ivec2(2 * (index % {{rounds_across}}), index / {{rounds_across}});
  vec4 start = texelFetch(rounds, texel, 0);
  vec4 axis = texelFetch(rounds, texel + ivec2(1, 0), 0);
  return Round(start.xyz, start.w, axis.xyz, axis.w);
}

// Vector from the closest point of the axis to a point.
vec3 outward_of(Round solid, vec3 point)
{
  vec3 outward = point - solid.start;
  float fraction = clamp(dot(outward, solid.axis) * solid.inverse_square, 0.0, 1.0);
  return outward - solid.axis * fraction;
}

SignedDistance round_distance(vec3 outward, float radius)
{
  float reach = length(outward);
  vec3 gradient = outward / max(reach, 1.0e-9);
  gradient.z = reach < 1.0e-9 ? 1.0 : gradient.z;  // on the axis itself any direction leads out
  return SignedDistance(reach - radius, gradient);
}
#endif

#ifdef HAS_FIELDS
struct Field {
  vec3 low;     // [m] place of node (0, 0, 0)
  float cell;   // [m]
  ivec3 nodes;  // along x, y and z
  int row;      // of the texture, where it begins
};

// A texel holds the values of four nodes: this one and its neighbours along z, y, and both.
vec4 nodes_at(Field field, int index)
{
  return texelFetch(fields,
                    ivec2(index % {{field_row}}, field.row + index / {{field_row}}), 0);
}

SignedDistance field_distance(Field field, vec3 point)
{
  vec3 top = vec3(field.nodes - 1);
  vec3 place = (point - field.low) * (1.0 / field.cell);
  vec3 clamped = clamp(place, vec3(0.0), top);
  float outside = length(place - clamped) * field.cell;
  clamped = min(clamped, top - 1.0e-3);
  ivec3 node = ivec3(clamped);
  vec3 f = clamped - vec3(node);
  int index = (node.z * field.nodes.y + node.y) * field.nodes.x + node.x;
  vec4 near = nodes_at(field, index);
  vec4 far = nodes_at(field, index + 1);
  // trilinear along z, then y, then x; the difference in each step gives a derivative
  vec4 dz = vec4(near.yw - near.xz, far.yw - far.xz);
  vec4 z = vec4(near.xz, far.xz) + f.z * dz;
  vec2 dy = z.yw - z.xz;
  vec2 y = z.xz + f.y * dy;
  vec2 slope_z = dz.xz + f.y * (dz.yw - dz.xz);
  vec3 gradient = vec3(y.y - y.x, mix(dy.x, dy.y, f.x), mix(slope_z.x, slope_z.y, f.x));
  return SignedDistance(y.x + f.x * gradient.x + outside, gradient * (1.0 / field.cell));
}
#endif

// Distance and gradient at a point of the collider's object space.
//
// For a field, collider_shape: nodes along x, y and z, then its row; grid_origin: xyz place of its first node, w its cell
// size. For round solids, collider_shape: the first one, their count, 0, -1.
SignedDistance collider_distance(vec4 collider_shape, vec4 grid_origin, vec3 local)
{
  SignedDistance found = SignedDistance(1.0e30, vec3(0.0));
#ifdef HAS_FIELDS
  if (collider_shape.w >= 0.0) {
    found = field_distance(Field(grid_origin.xyz, grid_origin.w, ivec3(collider_shape.xyz), int(collider_shape.w)), local);
  }
#endif
#ifdef HAS_ROUNDS
  if (collider_shape.w < 0.0) {
    vec4 nearest = vec4(0.0);  // xyz from the axis, w radius
    int end = int(collider_shape.x + collider_shape.y);
    for (int k = int(collider_shape.x); k < end; k++) {
      Round solid = round_at(k);
      vec3 outward = outward_of(solid, local);
      float away = length(outward) - solid.radius;
      nearest = away < found.distance ? vec4(outward, solid.radius) : nearest;
      found.distance = min(away, found.distance);
    }
    found = round_distance(nearest.xyz, nearest.w);
  }
#endif
  return found;
}
