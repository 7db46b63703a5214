// One sample of hair's shadow on meshes that Blender has drawn. Writes an image: y brightness on the screen
// without hair, x the part of it that hair takes. Where other hair has already written, this hair takes a
// fraction of what that left.
#include "lib_body_shadow.glsl"

layout(early_fragment_tests) in;

void main()
{
  vec3 facet = cross(dFdx(mesh_point), dFdy(mesh_point));
  vec2 brightness = unshadowed_and_shadowed(mesh_point, normalize(mesh_normal), facet);
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec2 before = imageLoad(blocked_and_all, pixel).xy;
  float fraction = (before.y > 0.0 ? 1.0 - before.x / before.y : 1.0) * brightness.y / brightness.x;
  // the maps of other hair may hold other meshes that block light
  float max_brightness = max(before.y, brightness.x);
  imageStore(blocked_and_all, pixel, vec4(max_brightness * (1.0 - fraction), max_brightness, 0.0, 0.0));
  color = vec4(0.0);
}
