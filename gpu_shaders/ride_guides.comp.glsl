// The rotation of each segment of a guide from its rest shape as carried by the root, and behind these the
// guide's displacement from its root; one invocation per guide. Twin of guide_turns in addon/refine/ride.py.
// Define: HAS_CURLS, where curls may stretch; then guide_axes gets each segment's direction at rest and its
// extension as a fraction, see guide_axes in addon/refine/curls.py.
#include "lib_root_frame.glsl"
#include "lib_strand_texel.glsl"
#include "lib_turn.glsl"
#ifdef HAS_CURLS
#include "lib_curls.glsl"
#endif

void main()
{
  int guide = int(gl_GlobalInvocationID.x);
  if (guide >= guide_count) {
    return;
  }
  int strand = int(texelFetch(guide_strands, counted_texel(guide), 0).x);
  RootMotion motion = root_motion_at(root_motions, min(strand, root_motion_count - 1));
  vec4 rest = texelFetch(guide_points, strand_texel(guide, 0, segment_count + 1), 0);
  vec3 carried = follow(rest.xyz, motion);
  vec3 now = texelFetch(guides_now, strand_texel(guide, 0, segment_count + 1), 0).xyz;
  imageStore(guide_turns, strand_texel(guide, segment_count, segment_count + 1), vec4(now - carried, 0.0));
  vec4 turn = vec4(0.0, 0.0, 0.0, 1.0);
  for (int segment = 0; segment < segment_count; segment++) {
    ivec2 texel = strand_texel(guide, segment + 1, segment_count + 1);
    vec4 rest_next = texelFetch(guide_points, texel, 0);
    vec3 carried_next = follow(rest_next.xyz, motion);
    vec3 now_next = texelFetch(guides_now, texel, 0).xyz;
    vec3 before = direction_of(carried_next - carried);
    vec3 here = before + turn_change(turn, before);
    turn = turn_product(minimal_rotation(here, direction_of(now_next - now)), turn);
    imageStore(guide_turns, strand_texel(guide, segment, segment_count + 1), turn);
#ifdef HAS_CURLS
    float size = length(carried_next - carried);  // w of a CV: whether the segment that begins there can stretch
    float extension = rest.w > 0.0 && size > 0.0 ? length(now_next - now) / size - 1.0 : 0.0;
    vec4 axis = vec4(before, visible_extension(extension));
    imageStore(guide_axes, strand_texel(guide, segment, segment_count + 1), axis);
#endif
    rest = rest_next;
    carried = carried_next;
    now = now_next;
  }
}
