#include "lib_kajiya_kay.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  vec3 point = texelFetch(points, at, 0).xyz;
  vec3 normal = strand_normal(point, texelFetch(tangents, at, 0).xyz, vec3(0.1, -0.2, 0.3));
  imageStore(result, at, vec4(normal, 0.0));
}
