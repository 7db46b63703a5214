// Overwrites points of some strands with stored ones; one invocation per point.
// Twin of LedOut.put in addon/refine/lead_out.py.
#include "lib_strand_texel.glsl"

void main()
{
  int index = int(gl_GlobalInvocationID.x);
  if (index >= point_count) {
    return;
  }
  ivec2 stored_texel = counted_texel(index);
  ivec2 texel = ivec2(texelFetch(led_texels, stored_texel, 0).xy);
  vec3 point = texelFetch(led_points, stored_texel, 0).xyz;
  imageStore(cv_points, texel, vec4(point, imageLoad(cv_points, texel).w));
}
