// Light from all around. Twin of addon/shading/environment.py: same names; what the terms mean is
// written there. Needs struct_lights.glsl. Holds no resources.
#include "lib_pi.glsl"

// MATT of addon/shading/environment.py
const vec2 MATT = vec2(2.0 / 3.0, 1.0 / 4.0);
// EIGHTH, CLOSED and CORNER_BLUR of addon/shading/environment.py
const vec2 EIGHTH = vec2(0.8660254037844386, 0.6366197723675814);
const float CLOSED = 1.0e-3, CORNER_BLUR = 0.39269908169872;

// Radiance from a direction, of which orders 1 and 2 are damped.
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

// Irradiance over pi, on a surface that faces this way.
vec3 matt_light(Lights lights, vec3 normal)
{
  return light_from(lights, normal, MATT);
}

// What stands for the light from an eighth of all directions, around a corner of a cube.
vec3 corner_direction(int corner)
{
  vec3 side = vec3(corner & 1, (corner >> 1) & 1, corner >> 2);
  return (2.0 * side - 1.0) * 0.5773502691896258;
}

// Its irradiance on what faces it.
vec3 corner_light(Lights lights, int corner)
{
  return 0.5 * PI * light_from(lights, corner_direction(corner), EIGHTH);
}

// Openness where only occlusion is known: to where hair looks away.
vec4 openness_by_occlusion(float occlusion, vec3 away)
{
  return 0.5 * occlusion * vec4(1.0, away);
}

// How many strands are between a place of hair and a direction, and beyond it, by its openness.
vec2 open_path(vec4 openness, vec3 towards)
{
  float bent = dot(openness.yzw, towards);
  return -log(clamp(vec2(openness.x + bent, openness.x - bent), CLOSED, 1.0));
}
