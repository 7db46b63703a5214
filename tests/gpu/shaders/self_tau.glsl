// The strands' own tau in the map of light 0.
#include "lib_opacity.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (at.x >= textureSize(points, 0).x) {
    return;
  }
  vec4 point_and_radius = texelFetch(points, at, 0);
  vec3 tangent = texelFetch(tangents, at, 0).xyz;
  float own = self_tau_at(opacity, 0, point_and_radius.xyz, tangent, point_and_radius.w);
  imageStore(result, at, vec4(own, 0.0, 0.0, 0.0));
}
