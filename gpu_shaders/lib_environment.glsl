// Light from all around. Twin of addon/shading/environment.py, which explains the terms: same names.
// Needs struct_lights.glsl. Holds no resources.
#include "lib_pi.glsl"

// LAMBERT_DAMPING of addon/shading/environment.py
const vec2 LAMBERT_DAMPING = vec2(2.0 / 3.0, 1.0 / 4.0);
// OCTANT_DAMPING, MIN_OPENNESS and OCTANT_BLUR of addon/shading/environment.py
const vec2 OCTANT_DAMPING = vec2(0.8660254037844386, 0.6366197723675814);
const float MIN_OPENNESS = 1.0e-3, OCTANT_BLUR = 0.39269908169872;

// Radiance from a direction. damping: factors on the harmonics of orders 1 and 2.
vec3 radiance_from(Lights lights, vec3 towards, vec2 damping)
{
  vec3 radiance = lights.ambient_and_count.xyz;
  vec3 square = towards * towards, mixed = towards.xyz * towards.yzx;
  radiance += damping.x * (lights.harmonics[0].xyz * towards.x + lights.harmonics[1].xyz * towards.y +
                        lights.harmonics[2].xyz * towards.z);
  radiance += damping.y * (lights.harmonics[3].xyz * mixed.x + lights.harmonics[4].xyz * mixed.y +
                        lights.harmonics[5].xyz * (3.0 * square.z - 1.0) +
                        lights.harmonics[6].xyz * mixed.z +
                        lights.harmonics[7].xyz * (square.x - square.y));
  return max(radiance, vec3(0.0));
}

// Irradiance over pi on a surface with this normal.
vec3 diffuse_light(Lights lights, vec3 normal)
{
  return radiance_from(lights, normal, LAMBERT_DAMPING);
}

// Unit direction to the middle of an octant; its light represents an eighth of all directions.
vec3 octant_direction(int octant)
{
  vec3 side = vec3(octant & 1, (octant >> 1) & 1, octant >> 2);
  return (2.0 * side - 1.0) * 0.5773502691896258;
}

// Irradiance of an octant's light on a surface that faces it.
vec3 octant_light(Lights lights, int octant)
{
  return 0.5 * PI * radiance_from(lights, octant_direction(octant), OCTANT_DAMPING);
}

// Openness from occlusion alone, largest towards `away`, the outward direction of the hair.
vec4 openness_from_occlusion(float occlusion, vec3 away)
{
  return 0.5 * occlusion * vec4(1.0, away);
}

// Number of strands between a place and the light from a direction (x), and beyond the place (y), from its
// openness.
vec2 path_from_openness(vec4 openness, vec3 towards)
{
  float directional = dot(openness.yzw, towards);
  return -log(clamp(vec2(openness.x + directional, openness.x - directional), MIN_OPENNESS, 1.0));
}
