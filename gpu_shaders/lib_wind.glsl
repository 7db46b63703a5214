// Wind with gusts, as a sum of random Fourier modes.
//
// Twin of addon/dynamics/wind.py. Reference: Kraichnan 1970. Needs the block `frame`.
#include "lib_sine.glsl"

// Velocity of the air [m/s] at a point; `turns` are the phases of the modes at this time [rad].
vec3 air_at(vec3 point, vec4 turns[{{wind_modes}} / 4])
{
  vec3 air = frame.wind.xyz;
  for (int i = 0; i < {{wind_modes}}; i++) {
    air += frame.swing[i].xyz * sine(dot(frame.wave[i].xyz, point) + turns[i / 4][i % 4]);
  }
  return air;
}
