// The fraction of light 0 (x) and light 1 (y) that meshes let through to points.
#include "lib_mesh_shadows.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (at.x >= textureSize(points, 0).x) {
    return;
  }
  vec3 point = texelFetch(points, at, 0).xyz, normal = texelFetch(normals, at, 0).xyz;
  imageStore(result, at, vec4(mesh_light(0, point, normal), mesh_light(1, point, normal), 0.0, 0.0));
}
