// Wind with gusts, as a sum of random Fourier modes.
//
// Twin of addon/dynamics/wind.py. Reference: Kraichnan 1970. Needs the block `frame`.
#include "lib_sine.glsl"

// Velocity of the air [m/s] at a point; `phases` are the phases of the modes at this time [rad].
vec3 air_at(vec3 point, vec4 phases[{{wind_modes}} / 4])
{
  vec3 air = frame.wind.xyz;
  for (int i = 0; i < {{wind_modes}}; i++) {
    air += frame.gust_amplitude[i].xyz * sine(dot(frame.gust_wave_vector[i].xyz, point) + phases[i / 4][i % 4]);
  }
  return air;
}
