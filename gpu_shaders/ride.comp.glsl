// Strands that ride on guides: carried by their own roots, they take on the guides' motion.
// Twin of ride in addon/refine/ride.py, behind follow in addon/groom/roots.py. One
// invocation a strand: on a software driver that takes a quarter less time than one a CV.
#include "lib_root_frame.glsl"
#include "lib_strand_texel.glsl"

void main()
{
  int strand = int(gl_GlobalInvocationID.x);
  if (strand >= strand_count) {
    return;
  }
  int mover = min(strand, mover_count - 1);
  RootMotion motion = unpacked_motion(texelFetch(root_motions, strand_texel(mover, 0, 4), 0),
                                      texelFetch(root_motions, strand_texel(mover, 1, 4), 0),
                                      texelFetch(root_motions, strand_texel(mover, 2, 4), 0),
                                      texelFetch(root_motions, strand_texel(mover, 3, 4), 0));
  // first texel: xyz the three guides; second: xyz their weights
  ivec3 guide = ivec3(texelFetch(guide_weights, strand_texel(strand, 0, 2), 0).xyz);
  vec3 weight = texelFetch(guide_weights, strand_texel(strand, 1, 2), 0).xyz;

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
