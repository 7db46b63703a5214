#include "lib_coverage.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  vec4 strip = texelFetch(strips, pixel, 0);
  imageStore(result, pixel, vec4(strip_coverage(strip.x, strip.y, abs(strip.zw))));
}
