// Strands that ride on guides: carried by their own roots, they turn with their guides.
// Twin of ride in addon/refine/ride.py, behind follow in addon/groom/roots.py. One
// invocation a strand.
//
// Defines: HAS_CURLS, where curls may be drawn out; HAS_CLEARANCE, where strands are to be led out of
// colliders: then the steps IS_HELD and IS_NEAR of lead_out.comp.glsl are done here, where all that they
// need is at hand.
#include "lib_root_frame.glsl"
#include "lib_strand_texel.glsl"
#include "lib_turn.glsl"
#ifdef HAS_CURLS
#include "lib_curls.glsl"
#endif
#ifdef HAS_CLEARANCE
#include "lib_signed_distance.glsl"
#endif

// What guides have at their segments, at a place along one of them [segments]: how it has turned, or
// where it points at rest and by how much it is longer.
vec4 value_at(sampler2D values, int guide, float place)
{
  float last = float(segment_count - 1);
  float held = clamp(place - 0.5, 0.0, last);
  int before = int(held);
  vec4 near = texelFetch(values, strand_texel(guide, before, segment_count + 1), 0);
  int after = min(before + 1, segment_count - 1);
  vec4 far = texelFetch(values, strand_texel(guide, after, segment_count + 1), 0);
  return near + (held - float(before)) * (far - near);
}

void main()
{
  int strand = int(gl_GlobalInvocationID.x);
  if (strand >= strand_count) {
    return;
  }
  RootMotion motion = root_motion_at(root_motions, min(strand, mover_count - 1));
  // xyz of three texels: the guides, their weights, their segments a metre
  ivec3 guide = ivec3(texelFetch(guide_weights, strand_texel(strand, 0, 3), 0).xyz);
  vec3 weight = texelFetch(guide_weights, strand_texel(strand, 1, 3), 0).xyz;
  vec3 per_meter = texelFetch(guide_weights, strand_texel(strand, 2, 3), 0).xyz;

  StrandSpan span = strand_span(strand_spans, strand);
  vec4 rest = imageLoad(rest_points, span.first);  // xyz position, w radius
  vec3 displacement = vec3(0.0);
  for (int k = 0; k < 3; k++) {
    ivec2 shift = strand_texel(guide[k], segment_count, segment_count + 1);
    displacement += weight[k] * texelFetch(guide_turns, shift, 0).xyz;
  }
#ifdef HAS_CLEARANCE
  int held = span.factors;  // the last point that goes with the root
  displacement = held > 0 ? vec3(0.0) : displacement;
  // a strand that was bent in the frame before is led on from its root
  bool was_bent = imageLoad(states, counted_texel(strand)).z > turned_back;
  int first_near = was_bent ? 1 : 0;
  Solid solid = solid_at(0);
#endif
  float reached = 0.0;
  for (int point = 0; point < span.count; point++) {
    vec3 here = follow(rest.xyz, motion) + displacement;
    imageStore(cv_points, span_texel(span, point), vec4(here, rest.w));
#ifdef HAS_CLEARANCE
    float clearance = imageLoad(clearances, span_texel(span, point)).x;
    float wanted = min(clearance + length(displacement), kept);
    float lack = wanted - signed_distance(solid, here, kept).w;
    first_near = first_near == 0 && lack > {{lead_slack}} * kept ? point : first_near;
#endif
    if (point + 1 == span.count) {
      break;
    }
    vec4 next = imageLoad(rest_points, span_texel(span, point + 1));
    vec3 edge = next.xyz - rest.xyz;
    float size = length(edge);
    vec3 place = (reached + 0.5 * size) * per_meter;
    vec4 blend = weight.x * value_at(guide_turns, guide.x, place.x);
    for (int k = 1; k < 3; k++) {
      vec4 turn = value_at(guide_turns, guide[k], place[k]);
      // of two quaternions of one rotation the nearer
      blend += (dot(turn, blend) < 0.0 ? -weight[k] : weight[k]) * turn;
    }
    blend.w += dot(blend, blend) < {{reversed_turn}} ? 1.0 : 0.0;
    vec3 carried = edge + motion.turn * edge;
#ifdef HAS_CURLS
    vec4 axis = vec4(0.0);
    for (int k = 0; k < 3; k++) {
      axis += weight[k] * value_at(guide_axes, guide[k], place[k]);
    }
    vec3 drawn = drawn_out(carried, axis);
#ifdef HAS_CLEARANCE
    drawn = point < held ? vec3(0.0) : drawn;
#endif
    displacement += drawn;
    carried += drawn;
#endif
#ifdef HAS_CLEARANCE
    displacement += point < held ? vec3(0.0) : turn_change(blend, carried);
#else
    displacement += turn_change(blend, carried);
#endif
    reached += size;
    rest = next;
  }
#ifdef HAS_CLEARANCE
  float is_moved = was_bent ? 2.0 : held > 0 || first_near > 0 ? 1.0 : 0.0;
  imageStore(states, counted_texel(strand), vec4(is_moved, float(first_near), 0.0, 0.0));
#endif
}
