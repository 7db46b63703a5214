#include "lib_marschner.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  vec3 angles = directions_to_angles(texelFetch(tangents, at, 0).xyz,
                                     texelFetch(lights, at, 0).xyz,
                                     texelFetch(eyes, at, 0).xyz);
  imageStore(result, at, vec4(angles, 0.0));
}
