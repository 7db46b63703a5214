// Strands that ride on guides, brought to where ties and surfaces hold them; one invocation a strand
// that is held. Twin of hold in addon/refine/hold.py.
#include "lib_strand_texel.glsl"

#define SWEEPS {{hold_sweeps}}
#define NEAR {{hold_near}}
#define TINY 1.0e-12

vec3 point_at(int strand, int cv)
{
  return imageLoad(cv_points, strand_texel(strand, cv, cv_count)).xyz;
}

void put(int strand, int cv, vec3 point)
{
  ivec2 texel = strand_texel(strand, cv, cv_count);
  imageStore(cv_points, texel, vec4(point, imageLoad(cv_points, texel).w));
}

// Of the segment from a CV to the next one, at rest.
float length_from(int strand, int cv)
{
  vec3 here = texelFetch(rest_points, strand_texel(strand, cv, cv_count), 0).xyz;
  vec3 next = texelFetch(rest_points, strand_texel(strand, cv + 1, cv_count), 0).xyz;
  return distance(here, next);
}

void put_beside(int strand, int cv, int other, float away)
{
  vec3 place = point_at(strand, other);
  vec3 offset = point_at(strand, cv) - place;
  put(strand, cv, place + offset * (away / max(length(offset), TINY)));
}

// Bring a strand to one hold; `before` is the last CV that is held so far. Returns the next such.
int bring(int strand, int number, int before, float whole_length)
{
  vec4 hold = texelFetch(holds, strand_texel(number, 0, 2), 0);  // x place, y anchor
  vec4 rest = vec4(texelFetch(holds, strand_texel(number, 1, 2), 0).xyz, 1.0);
  int first = int(hold.x);
  int after = min(first + 1, cv_count - 1);
  vec3 target;
  for (int row = 0; row < 3; row++) {
    target[row] = dot(texelFetch(anchors, strand_texel(int(hold.y), row, 3), 0), rest);
  }
  vec3 here = mix(point_at(strand, first), point_at(strand, after), hold.x - float(first));
  vec3 error = target - here;
  if (length(error) <= NEAR * whole_length) {
    return after;
  }
  float reach = 0.0;
  for (int cv = before; cv < first; cv++) {
    reach += length_from(strand, cv);
  }
  vec3 span = point_at(strand, first) + error - point_at(strand, before);
  error += span * (min(reach / max(length(span), TINY), 1.0) - 1.0);
  for (int cv = before + 1; cv < cv_count; cv++) {
    float part = min(float(cv - before) / float(max(first - before, 1)), 1.0);
    put(strand, cv, point_at(strand, cv) + error * part);
  }
  for (int sweep = 0; sweep < SWEEPS; sweep++) {
    for (int cv = first - 1; cv > before; cv--) {
      put_beside(strand, cv, cv + 1, length_from(strand, cv));
    }
    for (int cv = before + 1; cv < first; cv++) {
      put_beside(strand, cv, cv - 1, length_from(strand, cv - 1));
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
  ivec3 own = ivec3(texelFetch(held_strands, strand_texel(held, 0, 1), 0).xyz);
  float whole_length = 0.0;
  for (int cv = 0; cv < cv_count - 1; cv++) {
    whole_length += length_from(own.x, cv);
  }
  int before = {{pinned}} - 1;
  for (int number = 0; number < own.z; number++) {
    before = bring(own.x, own.y + number, before, whole_length);
  }
}
