// Twin of addon/shading/lights.py: the radiometric convention is written there.
// Needs struct_lights.glsl. Holds no resources.

vec3 light_direction(Lights lights, int index, vec3 point)
{
  vec4 light = lights.vector_and_kind[index];
  if (light.w == 0.0) {
    return light.xyz;
  }
  vec3 away = light.xyz - point;
  return away / max(length(away), {{nearest_distance}});
}

// Irradiance on a surface that faces the light [W/m^2].
vec3 light_irradiance(Lights lights, int index, vec3 point)
{
  vec4 light = lights.vector_and_kind[index];
  vec3 power = lights.power[index].xyz;
  if (light.w == 0.0) {
    return power;
  }
  float distance_to = max(length(light.xyz - point), {{nearest_distance}});
  return power / (4.0 * 3.14159265358979 * distance_to * distance_to);
}
