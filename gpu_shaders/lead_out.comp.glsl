// Strands that ride on guides, led out of colliders; one invocation a strand.
// Twin of lead_out in addon/refine/lead_out.py, in steps over points first_point to point_end - 1 of
// each strand: software drivers end a shader after 65,535 rounds of all its loops.
//
//   IS_LEASH  _pull_back: writes `states`, and cv_points of strands that go too far
//   IS_NEAR   which strands are too near: writes `states`, and `wanted` for each point
//   IS_LED    leads them: writes `led_points`
//   IS_PUT    copies these into cv_points
//
// states: x 1 where the strand is led, y its length [m], z by how much [m] any point is nearer than it
// must be, w 1 when it is out. The fourth number of strand_spans is the last point that has a leash.
// clearances: x how far [m] a point stays from colliders, y its leash [m].
#include "lib_strand_texel.glsl"
#if defined(IS_NEAR) || defined(IS_LED)
#include "lib_signed_distance.glsl"
#endif

#define SWEEPS {{lead_sweeps}}
#define TRIES {{lead_tries}}
#define HALVINGS {{lead_halvings}}
#define TINY 1.0e-30

vec3 riding_at(StrandSpan span, int point)
{
  return imageLoad(cv_points, span_texel(span, point)).xyz;
}

#include "lib_root_frame.glsl"

// Where the root of a strand carries it.
RootMotion motion_of(int strand)
{
  return root_motion_at(root_motions, min(strand, mover_count - 1));
}

vec3 carried_at(StrandSpan span, int point, RootMotion motion)
{
  return follow(texelFetch(rest_points, span_texel(span, point), 0).xyz, motion);
}

vec3 at_length(vec3 start, vec3 arm, float size)
{
  return start + arm * (size / max(length(arm), TINY));
}

#ifdef IS_LEASH
void put(StrandSpan span, int point, vec3 place)
{
  ivec2 texel = span_texel(span, point);
  imageStore(cv_points, texel, vec4(place, imageLoad(cv_points, texel).w));
}

void take(int strand, StrandSpan span, int end)
{
  int last = span.factors;
  RootMotion motion = motion_of(strand);
  float part = 1.0;
  for (int point = 1; point <= last; point++) {
    float leash = texelFetch(clearances, span_texel(span, point), 0).y;
    float away = distance(riding_at(span, point), carried_at(span, point, motion));
    part = min(part, {{leashed}} * leash / max(away, TINY));
  }
  if (part < 1.0) {
    vec3 riding_before = riding_at(span, 0);
    vec3 carried_before = carried_at(span, 0, motion);
    vec3 place = riding_before;
    for (int point = 1; point <= last; point++) {
      vec3 riding = riding_at(span, point);
      vec3 carried = carried_at(span, point, motion);
      vec3 segment = riding - riding_before;
      place = at_length(place, mix(carried - carried_before, segment, part), length(segment));
      put(span, point, place);
      riding_before = riding;
      carried_before = carried;
    }
    vec3 shift = place - riding_before;
    for (int point = last + 1; point < end; point++) {
      put(span, point, riding_at(span, point) + shift);
    }
  }
  imageStore(states, strand_texel(strand, 0, 1), vec4(part < 1.0 ? 1.0 : 0.0, 0.0, 0.0, 0.0));
}
#endif

#ifdef IS_NEAR
void take(int strand, StrandSpan span, int end)
{
  vec4 state = imageLoad(states, strand_texel(strand, 0, 1));
  RootMotion motion = motion_of(strand);
  for (int point = max(first_point, 1); point < end; point++) {
    vec3 here = riding_at(span, point);
    state.y += distance(riding_at(span, point - 1), here);
    ivec2 texel = span_texel(span, point);
    float away = distance(here, carried_at(span, point, motion));
    float goal = min(texelFetch(clearances, texel, 0).x + away, kept);
    imageStore(wanted, texel, vec4(goal));
    float lack = goal - signed_distance(here, kept).w;
    state.x = lack > {{lead_slack}} * kept ? 1.0 : state.x;
  }
  imageStore(states, strand_texel(strand, 0, 1), state);
}
#endif

#ifdef IS_LED
// Evenly over the sphere, on a spiral by the golden angle.
vec3 direction(int number)
{
  float height = 1.0 - (2.0 * float(number) + 1.0) / float(TRIES);
  float angle = {{golden_angle}} * float(number);
  float radius = sqrt(1.0 - height * height);
  return vec3(radius * cos(angle), radius * sin(angle), height);
}

// The end of a segment that is turned until it is out.
vec3 turned_out(vec3 start, vec3 arm, float size, float goal)
{
  arm /= max(size, TINY);
  vec3 out_of = vec3(0.0);
  float best = -1.0e30;
  for (int number = 0; number < TRIES; number++) {
    vec3 tried = direction(number);
    float lack = goal - signed_distance(start + size * tried, goal).w;
    // the nearest that leads out; if none does, the one that lacks least
    float worth = lack > 0.0 ? -1.0 - lack : dot(tried, arm);
    out_of = worth > best ? tried : out_of;
    best = max(worth, best);
  }
  float low = 0.0;
  float high = 1.0;
  for (int halving = 0; halving < HALVINGS; halving++) {
    float middle = (low + high) / 2.0;
    vec3 end = at_length(start, arm + middle * (out_of - arm), size);
    if (signed_distance(end, goal).w < goal) {
      low = middle;
    }
    else {
      high = middle;
    }
  }
  return at_length(start, arm + high * (out_of - arm), size);
}

// xyz: the end of a segment that is led out farther than it must be; w: by how much [m] it is nearer
// than it must be all the same.
vec4 led_out(vec3 start, vec3 segment, float needed, float farther)
{
  float size = length(segment);
  float goal = needed + farther;
  vec3 end = start + segment;
  for (int sweep = 0; sweep <= SWEEPS; sweep++) {
    vec4 found = signed_distance(end, kept + farther);
    float lack = goal - found.w;
    if (lack <= 0.0 || (sweep == SWEEPS && lack <= {{lead_slack}} * kept)) {
      return vec4(end, 0.0);
    }
    if (sweep < SWEEPS) {
      end = at_length(start, end + found.xyz * lack - start, size);
    }
  }
  end = turned_out(start, end - start, size, goal);
  return vec4(end, max(needed - signed_distance(end, kept).w, 0.0));
}

// A point within its leash; w: twice `kept` where it does not get there.
vec4 within_leash(vec3 here, vec3 start, float size, vec3 carried, float leash)
{
  for (int sweep = 0; sweep < SWEEPS; sweep++) {
    vec3 away = here - carried;
    float far = length(away);
    if (far <= leash) {
      return vec4(here, 0.0);
    }
    here = at_length(start, carried + away * ({{leashed}} * leash / far) - start, size);
  }
  return vec4(here, distance(here, carried) > leash ? 2.0 * kept : 0.0);
}

void take(int strand, StrandSpan span, int end)
{
  vec4 state = imageLoad(states, strand_texel(strand, 0, 1));
  if (state.x < 0.5 || state.w > 0.5) {
    return;
  }
  RootMotion motion = motion_of(strand);
  float farther = {{lead_margin}} * float(attempt) * state.y / float(span.count - 1);
  int first = max(first_point, 1);
  vec3 start = riding_at(span, 0);
  if (first_point == 0) {
    state.z = 0.0;
    imageStore(led_points, span_texel(span, 0), vec4(start, 0.0));
  }
  else {
    start = imageLoad(led_points, span_texel(span, first - 1)).xyz;
  }
  vec3 riding_start = riding_at(span, first - 1);
  for (int point = first; point < end; point++) {
    vec3 riding = riding_at(span, point);
    float goal = texelFetch(wanted, span_texel(span, point), 0).x;
    vec4 led = led_out(start, riding - riding_start, goal, farther);
    state.z = max(state.z, led.w);
    float leash = texelFetch(clearances, span_texel(span, point), 0).y;
    if (point <= span.factors) {
      float size = distance(riding, riding_start);
      led = within_leash(led.xyz, start, size, carried_at(span, point, motion), leash);
      state.z = max(state.z, led.w);
    }
    imageStore(led_points, span_texel(span, point), vec4(led.xyz, 0.0));
    start = led.xyz;
    riding_start = riding;
  }
  state.w = end == span.count && state.z <= {{lead_slack}} * kept ? 1.0 : 0.0;
  imageStore(states, strand_texel(strand, 0, 1), state);
}
#endif

#ifdef IS_PUT
void take(int strand, StrandSpan span, int end)
{
  vec4 state = texelFetch(states, strand_texel(strand, 0, 1), 0);
  if (state.x < 0.5) {
    return;
  }
  RootMotion motion = motion_of(strand);
  bool is_stuck = state.z > kept;  // then it is as its root carries it
  for (int point = first_point; point < end; point++) {
    ivec2 texel = span_texel(span, point);
    vec3 place = texelFetch(led_points, texel, 0).xyz;
    place = is_stuck ? carried_at(span, point, motion) : place;
    imageStore(cv_points, texel, vec4(place, imageLoad(cv_points, texel).w));
  }
}
#endif

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
