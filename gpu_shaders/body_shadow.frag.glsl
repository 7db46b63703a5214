// Hair's shadow on meshes that Blender has drawn, as black whose alpha is the fraction of the brightness that
// hair takes. Blender blends it over its picture in code values to the power of 2.2, see lib_output.glsl.
#include "lib_body_shadow.glsl"

void main()
{
  vec3 facet = cross(dFdx(mesh_point), dFdy(mesh_point));
  vec2 brightness = unshadowed_and_shadowed(mesh_point, normalize(mesh_normal), facet);
  color = vec4(vec3(0.0), 1.0 - brightness.y / brightness.x);
}
