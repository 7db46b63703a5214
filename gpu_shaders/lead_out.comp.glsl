// Leads strands that ride on guides out of colliders.
// Twin of lead_out in addon/refine/lead_out.py, in steps over points first_point to point_end - 1 of
// each strand: software drivers end a shader after 65,535 iterations of all its loops.
//
//   CARRY_ROOTS   _hold: moves the first points of strands rigidly with their roots; writes `states`,
//                 cv_points
//   FIND_NEAR     finds strands that are too near to colliders; writes `states`
//   COUNT_NEAR    counts these in each block of strands; writes `near_counts`
//   LIST_NEAR     lists them; writes `near_strands`, one after the other and their number behind the
//                 last, so that the next steps have no idle lanes
//   KEEP_BENDS    bends those that were bent in the frame before; changes cv_points, and sets
//                 `segment_bends` to the bend of each segment
//   LEAD_OUT      leads them out; writes `led_points`
//   STORE_POINTS  copies `led_points` into cv_points, and adds the bend by that to `segment_bends`
//
// Where drivers allow it, the first two steps are done as strands ride, see ride.comp.glsl, and the last
// three are one program.
// One invocation per strand, per block of strands in COUNT_NEAR and LIST_NEAR; in KEEP_BENDS, LEAD_OUT and
// STORE_POINTS one for every lane_count-th of the strands that are too near.
//
// states: x 1 where the strand is moved, 2 where it was bent in the frame before; y its first point that is
// too near, 0 for none; z the largest amount [m] by which a point is too near, after STORE_POINTS the
// largest bend of a segment; w 1 once the strand is out. The fourth number of strand_spans is the last point
// that moves rigidly with the root. clearances: distance [m] that a point keeps from colliders.
#include "lib_strand_texel.glsl"
#if defined(FIND_NEAR) || defined(LEAD_OUT)
#include "lib_signed_distance.glsl"
#endif
#if defined(KEEP_BENDS) || defined(STORE_POINTS)
#include "lib_turn.glsl"
#endif

#define SWEEPS {{lead_sweeps}}
#define DIRECTIONS {{lead_directions}}
#define BISECTIONS {{lead_bisections}}
#define TINY 1.0e-30

#define BLOCK {{lead_block}}

#if defined(COUNT_NEAR) || defined(LIST_NEAR)
bool is_near(int strand)
{
  return texelFetch(states, counted_texel(strand), 0).y > 0.5;
}
#else
vec3 ridden_point(StrandSpan span, int point)
{
#ifdef FIND_NEAR
  return texelFetch(cv_points, span_texel(span, point), 0).xyz;
#else
  return imageLoad(cv_points, span_texel(span, point)).xyz;
#endif
}

#include "lib_root_frame.glsl"

#if defined(CARRY_ROOTS) || defined(FIND_NEAR) || defined(LEAD_OUT) || defined(STORE_POINTS)
// Motion of a strand's root.
RootMotion motion_of(int strand)
{
  return root_motion_at(root_motions, min(strand, root_motion_count - 1));
}

vec3 carried_point(StrandSpan span, int point, RootMotion motion)
{
  return follow(texelFetch(rest_points, span_texel(span, point), 0).xyz, motion);
}
#endif

#if defined(FIND_NEAR) || defined(LEAD_OUT)
// Distance [m] that a point keeps from colliders. away: its distance from where its root carries it [m].
float wanted_clearance(StrandSpan span, int point, float away)
{
  return min(texelFetch(clearances, span_texel(span, point), 0).x + away, max_clearance);
}
#endif

vec3 at_length(vec3 start, vec3 arm, float size)
{
  return start + arm * (size / max(length(arm), TINY));
}
#endif

#ifdef CARRY_ROOTS
void process_strand(int strand, StrandSpan span, int end)
{
  int last = span.factors;
  RootMotion motion = motion_of(strand);
  vec3 shift = carried_point(span, last, motion) - ridden_point(span, last);
  for (int point = 0; last > 0 && point < end; point++) {
    ivec2 texel = span_texel(span, point);
    vec4 riding = imageLoad(cv_points, texel);
    vec3 place = point > last ? riding.xyz + shift : carried_point(span, point, motion);
    imageStore(cv_points, texel, vec4(place, riding.w));
  }
  // a strand that was bent in the frame before is led out from its root on
  bool was_bent = imageLoad(states, counted_texel(strand)).z > return_angle;
  float is_moved = was_bent ? 2.0 : last > 0 ? 1.0 : 0.0;
  vec4 state = vec4(is_moved, was_bent ? 1.0 : 0.0, 0.0, 0.0);
  imageStore(states, counted_texel(strand), state);
}
#endif

#ifdef FIND_NEAR
void process_strand(int strand, StrandSpan span, int end)
{
  vec4 state = imageLoad(states, counted_texel(strand));
  RootMotion motion = motion_of(strand);
  Solid solid = solid_at(0);
  for (int point = max(first_point, 1); point < end && state.y < 0.5; point++) {
    vec3 here = ridden_point(span, point);
    float away = distance(here, carried_point(span, point, motion));
    float shortfall = wanted_clearance(span, point, away) - signed_distance(solid, here, max_clearance).w;
    state.y = shortfall > {{lead_tolerance}} * max_clearance ? float(point) : state.y;
  }
  state.x = state.y > 0.5 ? max(state.x, 1.0) : state.x;
  imageStore(states, counted_texel(strand), state);
}
#endif

#ifdef KEEP_BENDS
void keep_bends(int strand, StrandSpan span)
{
  int end = imageLoad(states, counted_texel(strand)).x > 1.5 ? span.count : 0;
  vec3 shift = vec3(0.0);
  vec3 riding_start = ridden_point(span, 0);
  for (int point = 0; point < end; point++) {
    ivec2 texel = span_texel(span, point);
    vec4 riding = imageLoad(cv_points, texel);
    vec3 segment = riding.xyz - riding_start;
    vec3 along = direction_of(segment);
    vec3 bend = imageLoad(segment_bends, texel).xyz;
    bend *= max(1.0 - return_angle / max(length(bend), TINY), 0.0);
    vec3 bent = at_length(vec3(0.0), along + bend, length(segment));
    bool has_bend = bend != vec3(0.0);  // segments without a bend stay bit-identical
    shift += has_bend ? bent - segment : vec3(0.0);
    imageStore(segment_bends, texel, vec4(has_bend ? direction_of(bent) - along : vec3(0.0), 0.0));
    imageStore(cv_points, texel, vec4(riding.xyz + shift, riding.w));
    riding_start = riding.xyz;
  }
}
#endif

#ifdef LEAD_OUT
// Directions spread evenly over the sphere, on a spiral by the golden angle.
vec3 spiral_direction(int number)
{
  float height = 1.0 - (2.0 * float(number) + 1.0) / float(DIRECTIONS);
  float angle = {{golden_angle}} * float(number);
  float radius = sqrt(1.0 - height * height);
  return vec3(radius * cos(angle), radius * sin(angle), height);
}

// xyz: the end of a segment, turned until it is out; w: by how much [m] it is still nearer than `goal`.
// toward: unit direction in which its root carries it; tried first, since it does not jump from frame to
// frame.
vec4 turn_out(Solid solid, vec3 start, vec3 arm, float size, vec3 toward, float goal)
{
  arm /= max(size, TINY);
  vec3 best_direction = vec3(0.0);
  float best_score = -1.0e30;
  float remaining = 0.0;
  for (int number = -1; number < DIRECTIONS; number++) {
    vec3 candidate = number < 0 ? toward : spiral_direction(number);
    float shortfall = goal - signed_distance(solid, start + size * candidate, goal).w;
    // the nearest direction that leads out; if none does, the one with the smallest shortfall
    float score = shortfall > 0.0 ? -2.0 - shortfall : dot(candidate, arm);
    best_direction = score > best_score ? candidate : best_direction;
    remaining = score > best_score ? max(shortfall, 0.0) : remaining;
    best_score = max(score, best_score);
  }
  float low = 0.0;
  float high = 1.0;
  for (int bisection = 0; bisection < BISECTIONS; bisection++) {
    float middle = (low + high) / 2.0;
    vec3 end = at_length(start, arm + middle * (best_direction - arm), size);
    if (signed_distance(solid, end, goal).w < goal) {
      low = middle;
    }
    else {
      high = middle;
    }
  }
  return vec4(at_length(start, arm + high * (best_direction - arm), size), high < 1.0 ? 0.0 : remaining);
}

// How far [m] to move the end of a segment along the normal, so that it is farther out by `shortfall` [m]
// once the segment is back at its length.
float outward_shift(vec3 arm, vec3 outward, float size, float shortfall)
{
  float along = dot(arm, outward) / max(size, TINY);
  return shortfall / max(1.0 - along * along, {{lead_min_squared_sine}});
}

// One attempt to lead some points of a strand out, from the first that is too near on. extra_clearance:
// additional distance [m] from colliders.
void lead(StrandSpan span, int begin, int end, RootMotion motion, float extra_clearance, inout vec4 state)
{
  if (begin >= end) {
    return;
  }
  vec3 start = ridden_point(span, begin - 1);
  if (begin == int(state.y)) {
    state.z = 0.0;
  }
  else {
    start = imageLoad(led_points, span_texel(span, begin - 1)).xyz;
  }
  Solid solid = solid_at(0);
  int point = begin;
  // move points straight out until one must turn: so that neighbouring invocations turn at the same time
  do {
    vec3 arm = vec3(0.0);
    vec3 carried = vec3(0.0);
    float size = 0.0;
    float goal = 0.0;
    int sweep = 0;
    bool is_stuck = false;
    do {
      vec3 riding = ridden_point(span, point);
      vec3 segment = riding - ridden_point(span, point - 1);
      carried = carried_point(span, point, motion);
      size = length(segment);
      goal = wanted_clearance(span, point, distance(riding, carried)) + extra_clearance;
      vec3 here = sweep > 0 ? at_length(start, arm, size) : start + segment;
      vec4 found = signed_distance(solid, here, max_clearance + extra_clearance);
      float shortfall = goal - found.w;
      bool is_out = shortfall <= {{lead_tolerance}} * max_clearance;
      // deep inside a collider the normal may point to its other side
      is_stuck = !is_out && (sweep == SWEEPS || shortfall > {{lead_max_straight_move}} * size);
      arm = here - start;
      arm += is_stuck ? vec3(0.0) : found.xyz * outward_shift(arm, found.xyz, size, shortfall);
      if (is_out) {
        imageStore(led_points, span_texel(span, point), vec4(here, 0.0));
        start = here;
        point++;
      }
      sweep = is_out ? 0 : sweep + 1;
    } while (!is_stuck && point < end);
    if (is_stuck) {
      vec3 toward = carried - carried_point(span, point - 1, motion);
      vec4 turned = turn_out(solid, start, arm, size, at_length(vec3(0.0), toward, 1.0), goal);
      state.z = max(state.z, turned.w - extra_clearance);
      imageStore(led_points, span_texel(span, point), vec4(turned.xyz, 0.0));
      start = turned.xyz;
      point++;
    }
  } while (point < end);
}

void lead_strand(int strand, StrandSpan span, int end)
{
  vec4 state = imageLoad(states, counted_texel(strand));
  if (state.y < 0.5 || state.w > 0.5) {
    return;
  }
  RootMotion motion = motion_of(strand);
  for (int attempt = first_attempt; attempt < attempt_end && state.w < 0.5; attempt++) {
    float extra_clearance = 0.0;
    if (attempt > 0) {
      for (int point = 1; point < span.count; point++) {
        extra_clearance += distance(ridden_point(span, point - 1), ridden_point(span, point));
      }
      extra_clearance *= {{lead_extra_distance}} * float(attempt) / float(span.count - 1);
      state.y = 1.0;
    }
    lead(span, max(first_point, int(state.y)), end, motion, extra_clearance, state);
    state.w = end == span.count && state.z <= {{lead_tolerance}} * max_clearance ? 1.0 : 0.0;
  }
  imageStore(states, counted_texel(strand), state);
}
#endif

#ifdef STORE_POINTS
void store_points(int strand, StrandSpan span)
{
  vec4 state = imageLoad(states, counted_texel(strand));
  RootMotion motion = motion_of(strand);
  bool is_stuck = state.z > max_clearance;  // then the strand stays where its root carries it
  bool was_bent = state.x > 1.5;
  vec3 riding_start = ridden_point(span, 0);
  vec3 start = riding_start;
  float max_bend = 0.0;
  for (int point = 0; point < span.count; point++) {
    ivec2 texel = span_texel(span, point);
    vec4 riding = imageLoad(cv_points, texel);
    vec3 place = point < int(state.y) ? riding.xyz : imageLoad(led_points, texel).xyz;
    place = is_stuck ? carried_point(span, point, motion) : place;
    vec3 bend = direction_of(place - start) - direction_of(riding.xyz - riding_start);
    bend += was_bent ? imageLoad(segment_bends, texel).xyz : vec3(0.0);
    max_bend = max(max_bend, length(bend));
    imageStore(segment_bends, texel, vec4(bend, 0.0));
    imageStore(cv_points, texel, vec4(place, riding.w));
    riding_start = riding.xyz;
    start = place;
  }
  state.x = 1.0;
  state.z = max_bend > {{lead_min_deflection}} && !is_stuck ? max_bend : 0.0;
  imageStore(states, counted_texel(strand), state);
}
#endif

#if defined(KEEP_BENDS) || defined(LEAD_OUT) || defined(STORE_POINTS)
void main()
{
  int number = int(gl_GlobalInvocationID.x);
  int near_count = int(texelFetch(near_strands, counted_texel(strand_count), 0).x);
  if (number >= min(near_count, lane_count)) {
    return;
  }
  do {
    int strand = int(texelFetch(near_strands, counted_texel(number), 0).x);
    StrandSpan span = strand_span(strand_spans, strand);
#ifdef KEEP_BENDS
    keep_bends(strand, span);
#endif
#ifdef LEAD_OUT
    if (first_point < span.count) {
      lead_strand(strand, span, min(point_end, span.count));
    }
#endif
#ifdef STORE_POINTS
    store_points(strand, span);
#endif
    number += lane_count;
  } while (number < near_count);
}
#elif defined(COUNT_NEAR)
void main()
{
  int block = int(gl_GlobalInvocationID.x);
  int begin = block * BLOCK;
  if (begin >= strand_count) {
    return;
  }
  int count = 0;
  for (int strand = begin; strand < min(begin + BLOCK, strand_count); strand++) {
    count += is_near(strand) ? 1 : 0;
  }
  imageStore(near_counts, counted_texel(block), vec4(float(count)));
}
#elif defined(LIST_NEAR)
void main()
{
  int block = int(gl_GlobalInvocationID.x);
  int begin = block * BLOCK;
  if (begin >= strand_count) {
    return;
  }
  int number = 0;
  for (int before = 0; before < block; before++) {
    number += int(texelFetch(near_counts, counted_texel(before), 0).x);
  }
  int end = min(begin + BLOCK, strand_count);
  for (int strand = begin; strand < end; strand++) {
    if (is_near(strand)) {
      imageStore(near_strands, counted_texel(number), vec4(float(strand)));
      number++;
    }
  }
  if (end == strand_count) {
    imageStore(near_strands, counted_texel(strand_count), vec4(float(number)));
  }
}
#else
void main()
{
  int strand = int(gl_GlobalInvocationID.x);
  if (strand >= strand_count) {
    return;
  }
  StrandSpan span = strand_span(strand_spans, strand);
  if (first_point < span.count) {
    process_strand(strand, span, min(point_end, span.count));
  }
}
#endif
