// shadow_path_to_strand of light 0: without the strands themselves.
#include "lib_shadows.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (at.x >= textureSize(points, 0).x) {
    return;
  }
  vec4 point_and_radius = texelFetch(points, at, 0);
  vec3 tangent = texelFetch(tangents, at, 0).xyz;
  vec3 path = shadow_path_to_strand(0, point_and_radius.xyz, tangent, point_and_radius.w, 1.0);
  imageStore(result, at, vec4(path, 0.0));
}
