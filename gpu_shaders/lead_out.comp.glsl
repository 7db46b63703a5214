// Leads strands that ride on guides out of colliders.
// Twin of lead_out in addon/refine/lead_out.py, in steps over points first_point to point_end - 1 of
// each strand: software drivers end a shader after 65,535 iterations of all its loops.
//
//   IS_HELD     _hold: moves the first points of strands rigidly with their roots; writes `states`,
//               cv_points
//   IS_NEAR     finds strands that are too near to colliders; writes `states`
//   IS_COUNTED  counts these in each block of strands; writes `near_counts`
//   IS_LISTED   lists them; writes `near_strands`, one after the other and their number behind the
//               last, so that the next steps have no idle lanes
//   IS_BENT     bends those that were bent in the frame before; changes cv_points, and sets `leans` to
//               the bend of each segment
//   IS_LED      leads them out; writes `led_points`
//   IS_PUT      copies `led_points` into cv_points, and adds the bend by that to `leans`
//
// Where drivers allow it, the first two steps are done as strands ride, see ride.comp.glsl, and the last
// three are one program.
// One invocation per strand, per block of strands in IS_COUNTED and IS_LISTED; in IS_BENT, IS_LED and IS_PUT
// one for every lane_count-th of the strands that are too near.
//
// states: x 1 where the strand is moved, 2 where it was bent in the frame before; y its first point that is
// too near, 0 for none; z the largest amount [m] by which a point is too near, after IS_PUT the largest bend
// of a segment; w 1 once the strand is out. The fourth number of strand_spans is the last point that moves
// rigidly with the root. clearances: distance [m] that a point keeps from colliders.
#include "lib_strand_texel.glsl"
#if defined(IS_NEAR) || defined(IS_LED)
#include "lib_signed_distance.glsl"
#endif
#if defined(IS_BENT) || defined(IS_PUT)
#include "lib_turn.glsl"
#endif

#define SWEEPS {{lead_sweeps}}
#define TRIES {{lead_tries}}
#define HALVINGS {{lead_halvings}}
#define TINY 1.0e-30

#define BLOCK {{lead_block}}

#if defined(IS_COUNTED) || defined(IS_LISTED)
bool is_near(int strand)
{
  return texelFetch(states, counted_texel(strand), 0).y > 0.5;
}
#else
vec3 riding_at(StrandSpan span, int point)
{
#ifdef IS_NEAR
  return texelFetch(cv_points, span_texel(span, point), 0).xyz;
#else
  return imageLoad(cv_points, span_texel(span, point)).xyz;
#endif
}

#include "lib_root_frame.glsl"

#if defined(IS_HELD) || defined(IS_NEAR) || defined(IS_LED) || defined(IS_PUT)
// Motion of a strand's root.
RootMotion motion_of(int strand)
{
  return root_motion_at(root_motions, min(strand, mover_count - 1));
}

vec3 carried_at(StrandSpan span, int point, RootMotion motion)
{
  return follow(texelFetch(rest_points, span_texel(span, point), 0).xyz, motion);
}
#endif

#if defined(IS_NEAR) || defined(IS_LED)
// Distance [m] that a point keeps from colliders. away: its distance from where its root carries it [m].
float wanted_at(StrandSpan span, int point, float away)
{
  return min(texelFetch(clearances, span_texel(span, point), 0).x + away, kept);
}
#endif

vec3 at_length(vec3 start, vec3 arm, float size)
{
  return start + arm * (size / max(length(arm), TINY));
}
#endif

#ifdef IS_HELD
void take(int strand, StrandSpan span, int end)
{
  int last = span.factors;
  RootMotion motion = motion_of(strand);
  vec3 shift = carried_at(span, last, motion) - riding_at(span, last);
  for (int point = 0; last > 0 && point < end; point++) {
    ivec2 texel = span_texel(span, point);
    vec4 riding = imageLoad(cv_points, texel);
    vec3 place = point > last ? riding.xyz + shift : carried_at(span, point, motion);
    imageStore(cv_points, texel, vec4(place, riding.w));
  }
  // a strand that was bent in the frame before is led out from its root on
  bool was_bent = imageLoad(states, counted_texel(strand)).z > turned_back;
  float is_moved = was_bent ? 2.0 : last > 0 ? 1.0 : 0.0;
  vec4 state = vec4(is_moved, was_bent ? 1.0 : 0.0, 0.0, 0.0);
  imageStore(states, counted_texel(strand), state);
}
#endif

#ifdef IS_NEAR
void take(int strand, StrandSpan span, int end)
{
  vec4 state = imageLoad(states, counted_texel(strand));
  RootMotion motion = motion_of(strand);
  Solid solid = solid_at(0);
  for (int point = max(first_point, 1); point < end && state.y < 0.5; point++) {
    vec3 here = riding_at(span, point);
    float away = distance(here, carried_at(span, point, motion));
    float lack = wanted_at(span, point, away) - signed_distance(solid, here, kept).w;
    state.y = lack > {{lead_slack}} * kept ? float(point) : state.y;
  }
  state.x = state.y > 0.5 ? max(state.x, 1.0) : state.x;
  imageStore(states, counted_texel(strand), state);
}
#endif

#ifdef IS_BENT
void bend(int strand, StrandSpan span)
{
  int end = imageLoad(states, counted_texel(strand)).x > 1.5 ? span.count : 0;
  vec3 shift = vec3(0.0);
  vec3 riding_start = riding_at(span, 0);
  for (int point = 0; point < end; point++) {
    ivec2 texel = span_texel(span, point);
    vec4 riding = imageLoad(cv_points, texel);
    vec3 segment = riding.xyz - riding_start;
    vec3 along = direction_of(segment);
    vec3 lean = imageLoad(leans, texel).xyz;
    lean *= max(1.0 - turned_back / max(length(lean), TINY), 0.0);
    vec3 bent = at_length(vec3(0.0), along + lean, length(segment));
    bool is_lean = lean != vec3(0.0);  // segments without a bend stay bit-identical
    shift += is_lean ? bent - segment : vec3(0.0);
    imageStore(leans, texel, vec4(is_lean ? direction_of(bent) - along : vec3(0.0), 0.0));
    imageStore(cv_points, texel, vec4(riding.xyz + shift, riding.w));
    riding_start = riding.xyz;
  }
}
#endif

#ifdef IS_LED
// Directions spread evenly over the sphere, on a spiral by the golden angle.
vec3 direction(int number)
{
  float height = 1.0 - (2.0 * float(number) + 1.0) / float(TRIES);
  float angle = {{golden_angle}} * float(number);
  float radius = sqrt(1.0 - height * height);
  return vec3(radius * cos(angle), radius * sin(angle), height);
}

// xyz: the end of a segment, turned until it is out; w: by how much [m] it is still nearer than `goal`.
// toward: unit direction in which its root carries it; tried first, since it does not jump from frame to
// frame.
vec4 turned_out(Solid solid, vec3 start, vec3 arm, float size, vec3 toward, float goal)
{
  arm /= max(size, TINY);
  vec3 out_of = vec3(0.0);
  float best = -1.0e30;
  float left = 0.0;
  for (int number = -1; number < TRIES; number++) {
    vec3 tried = number < 0 ? toward : direction(number);
    float lack = goal - signed_distance(solid, start + size * tried, goal).w;
    // the nearest direction that leads out; if none does, the one that lacks least
    float worth = lack > 0.0 ? -2.0 - lack : dot(tried, arm);
    out_of = worth > best ? tried : out_of;
    left = worth > best ? max(lack, 0.0) : left;
    best = max(worth, best);
  }
  float low = 0.0;
  float high = 1.0;
  for (int halving = 0; halving < HALVINGS; halving++) {
    float middle = (low + high) / 2.0;
    vec3 end = at_length(start, arm + middle * (out_of - arm), size);
    if (signed_distance(solid, end, goal).w < goal) {
      low = middle;
    }
    else {
      high = middle;
    }
  }
  return vec4(at_length(start, arm + high * (out_of - arm), size), high < 1.0 ? 0.0 : left);
}

// How far [m] to move the end of a segment along the normal, so that it is farther out by `lack` [m] once
// the segment is back at its length.
float going_out(vec3 arm, vec3 outward, float size, float lack)
{
  float along = dot(arm, outward) / max(size, TINY);
  return lack / max(1.0 - along * along, {{lead_steepest}});
}

// One attempt to lead some points of a strand out, from the first that is too near on. farther: additional
// distance [m] from colliders.
void lead(StrandSpan span, int begin, int end, RootMotion motion, float farther, inout vec4 state)
{
  if (begin >= end) {
    return;
  }
  vec3 start = riding_at(span, begin - 1);
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
      vec3 riding = riding_at(span, point);
      vec3 segment = riding - riding_at(span, point - 1);
      carried = carried_at(span, point, motion);
      size = length(segment);
      goal = wanted_at(span, point, distance(riding, carried)) + farther;
      vec3 here = sweep > 0 ? at_length(start, arm, size) : start + segment;
      vec4 found = signed_distance(solid, here, kept + farther);
      float lack = goal - found.w;
      bool is_out = lack <= {{lead_slack}} * kept;
      // deep inside a collider the normal may point to its other side
      is_stuck = !is_out && (sweep == SWEEPS || lack > {{lead_deepest}} * size);
      arm = here - start;
      arm += is_stuck ? vec3(0.0) : found.xyz * going_out(arm, found.xyz, size, lack);
      if (is_out) {
        imageStore(led_points, span_texel(span, point), vec4(here, 0.0));
        start = here;
        point++;
      }
      sweep = is_out ? 0 : sweep + 1;
    } while (!is_stuck && point < end);
    if (is_stuck) {
      vec3 toward = carried - carried_at(span, point - 1, motion);
      vec4 turned = turned_out(solid, start, arm, size, at_length(vec3(0.0), toward, 1.0), goal);
      state.z = max(state.z, turned.w - farther);
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
    float farther = 0.0;
    if (attempt > 0) {
      for (int point = 1; point < span.count; point++) {
        farther += distance(riding_at(span, point - 1), riding_at(span, point));
      }
      farther *= {{lead_margin}} * float(attempt) / float(span.count - 1);
      state.y = 1.0;
    }
    lead(span, max(first_point, int(state.y)), end, motion, farther, state);
    state.w = end == span.count && state.z <= {{lead_slack}} * kept ? 1.0 : 0.0;
  }
  imageStore(states, counted_texel(strand), state);
}
#endif

#ifdef IS_PUT
void put(int strand, StrandSpan span)
{
  vec4 state = imageLoad(states, counted_texel(strand));
  RootMotion motion = motion_of(strand);
  bool is_stuck = state.z > kept;  // then the strand stays where its root carries it
  bool was_bent = state.x > 1.5;
  vec3 riding_start = riding_at(span, 0);
  vec3 start = riding_start;
  float most = 0.0;
  for (int point = 0; point < span.count; point++) {
    ivec2 texel = span_texel(span, point);
    vec4 riding = imageLoad(cv_points, texel);
    vec3 place = point < int(state.y) ? riding.xyz : imageLoad(led_points, texel).xyz;
    place = is_stuck ? carried_at(span, point, motion) : place;
    vec3 lean = direction_of(place - start) - direction_of(riding.xyz - riding_start);
    lean += was_bent ? imageLoad(leans, texel).xyz : vec3(0.0);
    most = max(most, length(lean));
    imageStore(leans, texel, vec4(lean, 0.0));
    imageStore(cv_points, texel, vec4(place, riding.w));
    riding_start = riding.xyz;
    start = place;
  }
  state.x = 1.0;
  state.z = most > {{lead_upright}} && !is_stuck ? most : 0.0;
  imageStore(states, counted_texel(strand), state);
}
#endif

#if defined(IS_BENT) || defined(IS_LED) || defined(IS_PUT)
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
#ifdef IS_BENT
    bend(strand, span);
#endif
#ifdef IS_LED
    if (first_point < span.count) {
      lead_strand(strand, span, min(point_end, span.count));
    }
#endif
#ifdef IS_PUT
    put(strand, span);
#endif
    number += lane_count;
  } while (number < near_count);
}
#elif defined(IS_COUNTED)
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
#elif defined(IS_LISTED)
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
    take(strand, span, min(point_end, span.count));
  }
}
#endif
