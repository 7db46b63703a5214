// Hair's shadow on meshes that Blender has drawn: how much of the light hair leaves, as black that
// lies over the finished picture. Blender lays what is drawn over its picture by the powers 2.2 of code
// values, see lib_output.glsl.
#include "lib_body_shadow.glsl"

void main()
{
  vec3 facet = cross(dFdx(mesh_point), dFdy(mesh_point));
  vec2 on_screen = all_and_left(mesh_point, normalize(mesh_normal), facet);
  color = vec4(vec3(0.0), 1.0 - on_screen.y / on_screen.x);
}
