// Normals of round strands, for test_atlas_pass.py.
#include "lib_atlas.glsl"

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  vec4 direction = texelFetch(directions, texel, 0);
  imageStore(result, texel, vec4(fibre_normal(direction.xyz, direction.w), 0.0));
}
