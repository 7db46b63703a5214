// x: the sine of an angle.
#include "lib_sine.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  imageStore(result, at, vec4(sine(texelFetch(angles, at, 0).x), 0.0, 0.0, 0.0));
}
