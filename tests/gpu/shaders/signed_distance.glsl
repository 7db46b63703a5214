// xyz: direction out of the nearest collider; w: distance to it, up to the point's w.
#include "lib_signed_distance.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  vec4 point = texelFetch(points, at, 0);
  imageStore(result, at, signed_distance(solid_at(0), point.xyz, point.w));
}
