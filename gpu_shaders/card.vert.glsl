// Cards, vertex stage. The pass that primes the depth and those that shade both run it. The depth test
// EQUAL passes only for bit-identical positions, hence `precise`.
#include "lib_skin_seen.glsl"

void main()
{
  card_uv = uv;
#if !PRIME
  card_point = position;
  card_normal = normal;
  card_tangent = tangent;
  card_occlusion = occlusion;
  card_along = along;
  card_depth = depth;
  // CardMesh.axes
  vec3 across = cross(tangent, normal);
  across /= max(length(across), 1.0e-12);
  vec3 ahead = cross(normal, across);
  card_openness = vec4(openness.x, from_axes(openness.yzw, ahead, normal));
  card_received = vec4(received.x, from_axes(received.yzw, ahead, normal));
  card_beneath = vec4(from_axes(beneath.xyz, ahead, normal), beneath.w);
#endif
  precise vec4 place = view.view_projection * vec4(position, 1.0);
  gl_Position = place;
}
