// Strands that ride on guides, led out of colliders; one invocation a strand.
// Twin of lead_out in addon/refine/lead_out.py, in steps over points first_point to point_end - 1 of
// each strand: software drivers end a shader after 65,535 rounds of all its loops.
//
//   IS_BEGIN  clearance_at: writes `clearances`
//   IS_NEAR   which strands are too near: writes `states`, and `wanted` for each point
//   IS_LED    leads them: writes `led_points`, which `put` copies into cv_points
//   IS_PUT    does so
//
// states: x 1 where the strand is too near, y its length [m], z by how much [m] any point is nearer
// than it must be, w 1 when it is out.
#include "lib_strand_texel.glsl"
#ifndef IS_PUT
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

#ifdef IS_BEGIN
void take(int strand, StrandSpan span, int end)
{
  for (int point = first_point; point < end; point++) {
    float near = point == 0 ? -1.0e30 : signed_distance(riding_at(span, point), kept).w;
    imageStore(clearances, span_texel(span, point), vec4(near));
  }
}
#endif

#ifdef IS_NEAR
#include "lib_root_frame.glsl"

void take(int strand, StrandSpan span, int end)
{
  vec4 state = imageLoad(states, strand_texel(strand, 0, 1));
  state = first_point == 0 ? vec4(0.0) : state;
  int mover = min(strand, mover_count - 1);
  RootMotion motion = unpacked_motion(texelFetch(root_motions, strand_texel(mover, 0, 4), 0),
                                      texelFetch(root_motions, strand_texel(mover, 1, 4), 0),
                                      texelFetch(root_motions, strand_texel(mover, 2, 4), 0),
                                      texelFetch(root_motions, strand_texel(mover, 3, 4), 0));
  for (int point = max(first_point, 1); point < end; point++) {
    vec3 here = riding_at(span, point);
    state.y += distance(riding_at(span, point - 1), here);
    ivec2 texel = span_texel(span, point);
    float away = distance(here, follow(texelFetch(rest_points, texel, 0).xyz, motion));
    float goal = min(texelFetch(clearances, texel, 0).x + away, kept);
    imageStore(wanted, texel, vec4(goal));
    float lack = goal - signed_distance(here, kept).w;
    state.x = lack > {{lead_slack}} * kept ? 1.0 : state.x;
  }
  imageStore(states, strand_texel(strand, 0, 1), state);
}
#endif

#ifdef IS_LED
vec3 at_length(vec3 start, vec3 arm, float size)
{
  return start + arm * (size / max(length(arm), TINY));
}

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

void take(int strand, StrandSpan span, int end)
{
  vec4 state = imageLoad(states, strand_texel(strand, 0, 1));
  if (state.x < 0.5 || state.w > 0.5) {
    return;
  }
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
    imageStore(led_points, span_texel(span, point), vec4(led.xyz, 0.0));
    state.z = max(state.z, led.w);
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
  if (texelFetch(states, strand_texel(strand, 0, 1), 0).x < 0.5) {
    return;
  }
  for (int point = max(first_point, 1); point < end; point++) {
    ivec2 texel = span_texel(span, point);
    float radius = imageLoad(cv_points, texel).w;
    imageStore(cv_points, texel, vec4(texelFetch(led_points, texel, 0).xyz, radius));
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
