// Moves strands that ride on guides to where ties and surfaces hold them; one invocation per held
// strand. Twin of hold in addon/refine/hold.py.
#include "lib_strand_texel.glsl"

#define SWEEPS {{hold_sweeps}}
#define MIN_ERROR {{min_hold_error}}
#define TINY 1.0e-12

vec3 point_at(StrandSpan span, int cv)
{
  return imageLoad(cv_points, span_texel(span, cv)).xyz;
}

void put(StrandSpan span, int cv, vec3 point)
{
  ivec2 texel = span_texel(span, cv);
  imageStore(cv_points, texel, vec4(point, imageLoad(cv_points, texel).w));
}

// Length at rest of the segment from a CV to the next one.
float length_from(StrandSpan span, int cv)
{
  vec3 here = texelFetch(rest_points, span_texel(span, cv), 0).xyz;
  vec3 next = texelFetch(rest_points, span_texel(span, cv + 1), 0).xyz;
  return distance(here, next);
}

void set_distance(StrandSpan span, int cv, int other, float away)
{
  vec3 place = point_at(span, other);
  vec3 offset = point_at(span, cv) - place;
  put(span, cv, place + offset * (away / max(length(offset), TINY)));
}

// Position to which an anchor carries a point of a strand at rest.
vec3 carried(StrandSpan span, int cv, int anchor)
{
  vec4 rest = vec4(texelFetch(rest_points, span_texel(span, cv), 0).xyz, 1.0);
  vec3 place;
  for (int row = 0; row < 3; row++) {
    place[row] = dot(texelFetch(anchors, strand_texel(anchor, row, 3), 0), rest);
  }
  return place;
}

// Bring a strand to one hold. before: the last CV that is held so far; returns the next such CV.
int move_to_hold(StrandSpan span, int number, int before, float whole_length)
{
  vec2 hold = texelFetch(holds, counted_texel(number), 0).xy;  // place, anchor
  int first = int(hold.x);
  int after = min(first + 1, span.count - 1);
  vec3 target = carried(span, first, int(hold.y));
  vec3 beyond = carried(span, after, int(hold.y));
  vec3 here = point_at(span, first);
  vec3 there = point_at(span, after);
  if (max(distance(target, here), distance(beyond, there)) <= MIN_ERROR * whole_length) {
    return after;
  }
  float reach = 0.0;
  for (int cv = before; cv < first; cv++) {
    reach += length_from(span, cv);
  }
  vec3 start = point_at(span, before);
  vec3 offset = target - start;
  offset *= min(reach / max(length(offset), TINY), 1.0);
  vec3 direction = beyond - target;
  if (after > first) {
    direction *= length_from(span, first) / max(length(direction), TINY);
  }
  vec3 shift = start + offset - here;
  vec3 shift_beyond = start + offset + direction - there;
  for (int cv = before + 1; cv < span.count; cv++) {
    float part = min(float(cv - before) / float(max(first - before, 1)), 1.0);
    put(span, cv, point_at(span, cv) + (cv > first ? shift_beyond : shift * part));
  }
  for (int sweep = 0; sweep < SWEEPS; sweep++) {
    for (int cv = first - 1; cv > before; cv--) {
      set_distance(span, cv, cv + 1, length_from(span, cv));
    }
    for (int cv = before + 1; cv < first; cv++) {
      set_distance(span, cv, cv - 1, length_from(span, cv - 1));
    }
  }
  return after;
}

void main()
{
  int held = int(gl_GlobalInvocationID.x);
  if (held >= held_count) {
    return;
  }
  // x the strand, y its first hold, z how many it has
  ivec3 held_strand = ivec3(texelFetch(held_strands, counted_texel(held), 0).xyz);
  StrandSpan span = strand_span(strand_spans, held_strand.x);
  float whole_length = 0.0;
  for (int cv = 0; cv < span.count - 1; cv++) {
    whole_length += length_from(span, cv);
  }
  int before = {{pinned_count}} - 1;
  for (int number = 0; number < held_strand.z; number++) {
    before = move_to_hold(span, held_strand.y + number, before, whole_length);
  }
}
