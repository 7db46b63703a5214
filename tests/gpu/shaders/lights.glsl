// Row 2 i: direction to light i, and the number of lights (w); row 2 i + 1: its irradiance.
#include "lib_lights.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  vec3 point = texelFetch(points, ivec2(at.x, 0), 0).xyz;
  int index = at.y / 2;
  vec3 to_light, irradiance;
  light_at(lights, index, point, to_light, irradiance);
  vec3 value = at.y % 2 == 0 ? to_light : irradiance;
  imageStore(result, at, vec4(value, lights.ambient_and_count.w));
}
