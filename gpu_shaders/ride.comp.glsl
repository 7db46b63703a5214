// Strands that ride on guides: each is carried by its root, and its segments turn with those of its guides.
// Twin of ride in addon/refine/ride.py after follow in addon/groom/roots.py. One invocation per strand.
//
// Defines: HAS_CURLS, where curls may stretch; HAS_CLEARANCE, where strands are led out of colliders: then
// the steps CARRY_ROOTS and FIND_NEAR of lead_out.comp.glsl are done here, where their inputs are at hand.
#include "lib_root_frame.glsl"
#include "lib_strand_texel.glsl"
#include "lib_turn.glsl"
#ifdef HAS_CURLS
#include "lib_curls.glsl"
#endif
#ifdef HAS_CLEARANCE
#include "lib_signed_distance.glsl"
#endif

// Where a segment of a strand rides: between the middles of two consecutive segments of a guide. The texel
// behind the last segment may be read, with weight 0.
struct GuideSegment {
  ivec2 before;  // texel of the first of the two
  float fraction;
};

// The guide segments at a place along a guide [segments].
GuideSegment guide_segment_at(int guide, float place)
{
  float from_middle = clamp(place - 0.5, 0.0, float(segment_count - 1));
  int before = int(from_middle);
  return GuideSegment(strand_texel(guide, before, segment_count + 1), from_middle - float(before));
}

vec4 turn_at(GuideSegment segment)
{
  vec4 near = imageLoad(guide_turns, segment.before);
  vec4 far = imageLoad(guide_turns, segment.before + ivec2(1, 0));
  return near + segment.fraction * (far - near);
}

#ifdef HAS_CURLS
vec4 axis_at(GuideSegment segment)
{
  vec4 near = imageLoad(guide_axes, segment.before);
  vec4 far = imageLoad(guide_axes, segment.before + ivec2(1, 0));
  return near + segment.fraction * (far - near);
}
#endif

void main()
{
  int strand = int(gl_GlobalInvocationID.x);
  if (strand >= strand_count) {
    return;
  }
  RootMotion motion = root_motion_at(root_motions, min(strand, root_motion_count - 1));
  // xyz of three texels: the guides, their weights, their segments per metre
  ivec3 guide = ivec3(texelFetch(guide_weights, strand_texel(strand, 0, 3), 0).xyz);
  vec3 weight = texelFetch(guide_weights, strand_texel(strand, 1, 3), 0).xyz;
  vec3 per_meter = texelFetch(guide_weights, strand_texel(strand, 2, 3), 0).xyz;

  StrandSpan span = strand_span(strand_spans, strand);
  vec4 rest = imageLoad(rest_points, span.first);  // xyz position, w radius
  vec3 displacement = vec3(0.0);
  for (int k = 0; k < 3; k++) {
    ivec2 shift = strand_texel(guide[k], segment_count, segment_count + 1);
    displacement += weight[k] * imageLoad(guide_turns, shift).xyz;
  }
#ifdef HAS_CLEARANCE
  int last_held = span.factors;  // the last point that moves rigidly with the root
  displacement = last_held > 0 ? vec3(0.0) : displacement;
  // a strand that was bent in the frame before is led out from its root on
  bool was_bent = imageLoad(states, counted_texel(strand)).z > return_angle;
  int first_near = was_bent ? 1 : 0;
  Solid solid = solid_at(0);
#endif
  imageStore(cv_points, span.first, vec4(follow(rest.xyz, motion) + displacement, rest.w));
  float arc_length = 0.0;
  int point = 0;
  // a strand has at least one segment; software drivers run loops once even if their condition is false
  do {
    point++;
    vec4 next = imageLoad(rest_points, span_texel(span, point));
    vec3 edge = next.xyz - rest.xyz;
    float size = length(edge);
    vec3 place = (arc_length + 0.5 * size) * per_meter;
    vec4 blend = weight.x * turn_at(guide_segment_at(guide.x, place.x));
    for (int k = 1; k < 3; k++) {
      vec4 turn = turn_at(guide_segment_at(guide[k], place[k]));
      // q and -q are the same rotation: take the nearer one
      blend += (dot(turn, blend) < 0.0 ? -weight[k] : weight[k]) * turn;
    }
    blend.w += dot(blend, blend) < {{reversal_limit}} ? 1.0 : 0.0;
    vec3 carried = edge + motion.turn * edge;
    vec3 change = vec3(0.0);
#ifdef HAS_CURLS
    vec4 axis = vec4(0.0);
    for (int k = 0; k < 3; k++) {
      axis += weight[k] * axis_at(guide_segment_at(guide[k], place[k]));
    }
    change = change_by_extension(carried, axis);
    carried += change;
#endif
    change += turn_change(blend, carried);
#ifdef HAS_CLEARANCE
    change = point <= last_held ? vec3(0.0) : change;
#endif
    displacement += change;
    arc_length += size;
    rest = next;
    vec3 here = follow(rest.xyz, motion) + displacement;
    imageStore(cv_points, span_texel(span, point), vec4(here, rest.w));
#ifdef HAS_CLEARANCE
    float clearance = imageLoad(clearances, span_texel(span, point)).x;
    float goal = min(clearance + length(displacement), max_clearance);
    float shortfall = goal - signed_distance(solid, here, max_clearance).w;
    first_near = first_near == 0 && shortfall > {{lead_tolerance}} * max_clearance ? point : first_near;
#endif
  } while (point + 1 < span.count);
#ifdef HAS_CLEARANCE
  float is_moved = was_bent ? 2.0 : last_held > 0 || first_near > 0 ? 1.0 : 0.0;
  imageStore(states, counted_texel(strand), vec4(is_moved, float(first_near), 0.0, 0.0));
#endif
}
