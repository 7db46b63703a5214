// angles: theta_i, theta_r, phi and the level; absorptions: rgb.
#include "lib_marschner.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  vec4 angles_and_level = texelFetch(angles, at, 0);
  vec3 scattered = look_up(longitudinal,
                           azimuthal,
                           paths,
                           angles_and_level.xyz,
                           texelFetch(absorptions, at, 0).xyz,
                           fibre.strengths,
                           angles_and_level.w);
  imageStore(result, at, vec4(scattered, 0.0));
}
