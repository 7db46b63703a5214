// xyz: the gradient of the distance at a point; w: the distance. For points with w 0 from the first
// round solid, with w 1 from the field that begins in row 0.
#include "lib_collider.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  vec4 point = texelFetch(points, at, 0);
  vec4 grid_origin = texelFetch(field_grid, ivec2(0, 0), 0);
  ivec3 nodes = ivec3(texelFetch(field_grid, ivec2(1, 0), 0).xyz);
  Round solid = round_at(0);
  SignedDistance found = round_distance(outward_of(solid, point.xyz), solid.radius);
  if (point.w == 1.0) {
    found = field_distance(Field(grid_origin.xyz, grid_origin.w, nodes, 0), point.xyz);
  }
  imageStore(result, at, vec4(found.gradient, found.distance));
}
