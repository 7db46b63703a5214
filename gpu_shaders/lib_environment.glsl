// Light from all around. Twin of addon/shading/environment.py, which explains the terms: same names.
// Needs struct_lights.glsl. Holds no resources.
#include "lib_pi.glsl"

// MATT of addon/shading/environment.py
const vec2 MATT = vec2(2.0 / 3.0, 1.0 / 4.0);
// EIGHTH, CLOSED and CORNER_BLUR of addon/shading/environment.py
const vec2 EIGHTH = vec2(0.8660254037844386, 0.6366197723675814);
const float CLOSED = 1.0e-3, CORNER_BLUR = 0.39269908169872;

// Radiance from a direction. kept: factors on the harmonics of orders 1 and 2.
vec3 light_from(Lights lights, vec3 towards, vec2 kept)
{
  vec3 radiance = lights.ambient_and_count.xyz;
  vec3 square = towards * towards, mixed = towards.xyz * towards.yzx;
  radiance += kept.x * (lights.harmonics[0].xyz * towards.x + lights.harmonics[1].xyz * towards.y +
                        lights.harmonics[2].xyz * towards.z);
  radiance += kept.y * (lights.harmonics[3].xyz * mixed.x + lights.harmonics[4].xyz * mixed.y +
                        lights.harmonics[5].xyz * (3.0 * square.z - 1.0) +
                        lights.harmonics[6].xyz * mixed.z +
                        lights.harmonics[7].xyz * (square.x - square.y));
  return max(radiance, vec3(0.0));
}

// Irradiance over pi on a surface with this normal.
vec3 matt_light(Lights lights, vec3 normal)
{
  return light_from(lights, normal, MATT);
}

// Unit direction to a corner of a cube; its light represents an eighth of all directions.
vec3 corner_direction(int corner)
{
  vec3 side = vec3(corner & 1, (corner >> 1) & 1, corner >> 2);
  return (2.0 * side - 1.0) * 0.5773502691896258;
}

// Irradiance of a corner's light on a surface that faces it.
vec3 corner_light(Lights lights, int corner)
{
  return 0.5 * PI * light_from(lights, corner_direction(corner), EIGHTH);
}

// Openness from occlusion alone, largest towards `away`, the outward direction of the hair.
vec4 openness_by_occlusion(float occlusion, vec3 away)
{
  return 0.5 * occlusion * vec4(1.0, away);
}

// Number of strands between a place and the light from a direction (x), and beyond the place (y), from its
// openness.
vec2 open_path(vec4 openness, vec3 towards)
{
  float bent = dot(openness.yzw, towards);
  return -log(clamp(vec2(openness.x + bent, openness.x - bent), CLOSED, 1.0));
}
