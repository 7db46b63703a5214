// Adds the weighted displacements of guides to strands that their own roots carry; one invocation per
// strand. An earlier method, without turns of segments, kept for bench/_strands_cost.py alone.
#include "lib_root_frame.glsl"
#include "lib_strand_texel.glsl"

void main()
{
  int strand = int(gl_GlobalInvocationID.x);
  if (strand >= strand_count) {
    return;
  }
  RootMotion motion = root_motion_at(root_motions, strand);
  // xyz of the first two of three texels: the guides, their weights
  ivec3 guide = ivec3(texelFetch(guide_weights, strand_texel(strand, 0, 3), 0).xyz);
  vec3 weight = texelFetch(guide_weights, strand_texel(strand, 1, 3), 0).xyz;
  for (int cv = 0; cv < cv_count; cv++) {
    ivec2 texel = strand_texel(strand, cv, cv_count);
    vec4 rest = texelFetch(rest_points, texel, 0);  // xyz position, w radius
    vec3 moved = follow(rest.xyz, motion);
    for (int k = 0; k < 3; k++) {
      moved += weight[k] * texelFetch(guide_motions, strand_texel(guide[k], cv, cv_count), 0).xyz;
    }
    imageStore(cv_points, texel, vec4(moved, rest.w));
  }
}
