// How far the guides have left the shape in which their roots carry them; one invocation a CV.
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
  int strand = int(texelFetch(guide_strands, strand_texel(guide, 0, 1), 0).x);
  int mover = min(strand, mover_count - 1);
  RootMotion motion = unpacked_motion(texelFetch(root_motions, strand_texel(mover, 0, 4), 0),
                                      texelFetch(root_motions, strand_texel(mover, 1, 4), 0),
                                      texelFetch(root_motions, strand_texel(mover, 2, 4), 0),
                                      texelFetch(root_motions, strand_texel(mover, 3, 4), 0));
  vec3 rest = texelFetch(rest_points, strand_texel(strand, cv, cv_count), 0).xyz;
  ivec2 texel = strand_texel(guide, cv, cv_count);
  vec3 left = texelFetch(guides_now, texel, 0).xyz - follow(rest, motion);
  imageStore(guide_motions, texel, vec4(left, 0.0));
}
