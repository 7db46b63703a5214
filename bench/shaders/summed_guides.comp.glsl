// Displacements of guides from the shape that their roots carry; one invocation per CV. For the earlier
// method of riding of summed_ride.comp.glsl, kept for bench/_strands_cost.py alone.
#include "lib_root_frame.glsl"
#include "lib_strand_texel.glsl"

void main()
{
  ivec2 place = ivec2(gl_GlobalInvocationID.xy);
  int cv = place.x;
  int guide = place.y;
  if (cv >= cv_count || guide >= guide_count) {
    return;
  }
  int strand = int(texelFetch(guide_strands, counted_texel(guide), 0).x);
  RootMotion motion = root_motion_at(root_motions, strand);
  ivec2 texel = strand_texel(guide, cv, cv_count);
  vec3 rest = texelFetch(guide_points, texel, 0).xyz;
  vec3 left = texelFetch(guides_now, texel, 0).xyz - follow(rest, motion);
  imageStore(guide_motions, texel, vec4(left, 0.0));
}
