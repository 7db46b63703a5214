// Dual scattering from angles and tau, absorption and density, the strand's own S and tau beyond.
#include "lib_dual.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  vec4 angles = texelFetch(angles_and_tau, at, 0);
  vec4 absorption = texelFetch(absorption_and_density, at, 0);
  float cos_d = cos(0.5 * (angles.y - angles.x));
  mat3x4 onward = fractions_at(forward, cos_d, absorption.xyz);
  mat3x4 back = fractions_at(backward, cos_d, absorption.xyz);
  vec4 single = texelFetch(singles_and_beyond, at, 0);
  vec3 found = dual_scattering(
      single.xyz, angles.xyz, onward, back, angles.w, single.w, fibre, absorption.w);
  imageStore(result, at, vec4(found, 0.0));
}
