// Guides at a frame's very end: moved as a whole to where their roots are, and what is held to where
// it is held, which bridges the time that is left over. One invocation a CV. Defines: HAS_HELD.
//
// Twin of grid_at_frame_end in addon/dynamics/step.py.
#include "lib_strand_texel.glsl"

void main()
{
  ivec2 id = ivec2(gl_GlobalInvocationID.xy);
  if (id.x >= cv_count || id.y >= guide_count) {
    return;
  }
  ivec2 root = strand_texel(id.y, 0, cv_count);
  ivec2 texel = strand_texel(id.y, id.x, cv_count);
  vec3 displacement = texelFetch(styles_now, root, 0).xyz - texelFetch(positions, root, 0).xyz;
#ifdef HAS_HELD
  displacement += texelFetch(beside_root, texel, 0).xyz;
#endif
  imageStore(bridged, texel, vec4(texelFetch(positions, texel, 0).xyz + displacement, 0.0));
}
