// Which samples count, and the position of places among them, for test_atlas_pass.py.
#include "lib_atlas.glsl"

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  vec4 number = texelFetch(numbers, texel, 0);
  bool counts = is_counted(uint(number.x), uint(number.y), uint(number.z), number.w);
  vec2 place = sheared(number.xy / 16384.0, 512.0, vec2(64.0, 32.0));
  imageStore(result, texel, vec4(counts ? 1.0 : 0.0, place, 0.0));
}
