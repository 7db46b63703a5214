// How many straight pieces a segment of a strand needs in the picture: its detail factor.
//
// Twin of addon/refine/detail.py, which has the derivation.
// References: Wang 1984, subdivision depth of Bezier curves; Rapp and Spielmann, Real-time hair
// rendering with screen space adaptive level of detail.
// Needs the struct DetailSettings. Holds no resources.

const float NEAREST = {{detail_nearest}};        // [m] in clip space's w
const float SIDE_MARGIN = 1.0 + {{detail_margin}};
const float FULL_ANGLE = 0.78539816339744831;

// A segment's Bezier control points.
struct Control {
  vec4 b0, b1, b2, b3;
};

// Control points of the segment from p1 to p2, in clip space or in the world.
Control segment_control(vec4 p0, vec4 p1, vec4 p2, vec4 p3)
{
  const float sixth = 1.0 / 6.0;
  return Control(p1, p1 + (p2 - p0) * sixth, p2 - (p3 - p1) * sixth, p2);
}

// Squared size in pixels of the larger of two second differences, seen from one control point.
float bend_size_from(vec4 b, vec4 bend_from, vec4 bend_to, vec2 half_size)
{
  vec2 slope = b.xy / b.w;
  vec2 shift_from = half_size * (bend_from.xy - slope * bend_from.w);
  vec2 shift_to = half_size * (bend_to.xy - slope * bend_to.w);
  return max(dot(shift_from, shift_from), dot(shift_to, shift_to));
}

// The largest size in pixels of two second differences, seen from any control point.
float bend_size(Control control, vec4 bend_from, vec4 bend_to, vec2 half_size)
{
  return sqrt(max(max(bend_size_from(control.b0, bend_from, bend_to, half_size),
                      bend_size_from(control.b1, bend_from, bend_to, half_size)),
                  max(bend_size_from(control.b2, bend_from, bend_to, half_size),
                      bend_size_from(control.b3, bend_from, bend_to, half_size))));
}

// The smallest number of pieces by Wang's bound, not clamped; `max_pieces` for a segment that comes nearer to
// the eye than NEAREST, where there is no bound. `control` in clip space, half_size and error in pixels.
float wang_pieces(Control control, vec2 half_size, float error, float max_pieces)
{
  float nearest = min(min(control.b0.w, control.b1.w), min(control.b2.w, control.b3.w));
  if (nearest < NEAREST) {
    return max_pieces;
  }
  vec4 bend_from = control.b0 - 2.0 * control.b1 + control.b2;
  vec4 bend_to = control.b1 - 2.0 * control.b2 + control.b3;
  vec4 third = (bend_to - bend_from) * (1.0 / 3.0);
  float scale = 0.75 / error;
  float one = scale * bend_size(control, bend_from + third, bend_to - third, half_size) / nearest;
  float many = scale * bend_size(control, bend_from, bend_to, half_size) / nearest;
  return one <= 1.0 ? 1.0 : ceil(sqrt(many));
}

// Angle between two directions, in 0..pi; 0 where one has no length.
float angle_between(vec3 one, vec3 two)
{
  float across = length(cross(one, two));
  float along = dot(one, two);
  return across == 0.0 && along == 0.0 ? 0.0 : atan(across, along);
}

// Number of pieces by the segment's size in the picture and the larger of the angles at its ends. from and
// to are its ends in clip space, half_size and piece_length in pixels.
float heuristic_pieces(vec4 from, vec4 to, float angle, vec2 half_size, float piece_length)
{
  vec2 step = to.xy / max(to.w, NEAREST) - from.xy / max(from.w, NEAREST);
  return ceil(length(half_size * step) / piece_length * min(angle / FULL_ANGLE, 1.0));
}

// Whether all control points, in clip space, lie beyond one plane of the frustum.
bool is_outside(Control control)
{
  vec3 margin = vec3(SIDE_MARGIN, SIDE_MARGIN, 1.0);
  bvec3 below = bvec3(true), above = bvec3(true);
  vec4 points[4] = vec4[4](control.b0, control.b1, control.b2, control.b3);
  for (int j = 0; j < 4; j++) {
    vec3 edge = margin * points[j].w;
    below = bvec3(uvec3(below) & uvec3(lessThan(points[j].xyz, -edge)));
    above = bvec3(uvec3(above) & uvec3(greaterThan(points[j].xyz, edge)));
  }
  return any(below) || any(above);
}
