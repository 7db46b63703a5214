// Strands, fragment stage: all lights and the world's, without shadows but the occlusion.
#include "lib_lights.glsl"
#include "lib_strand_noise.glsl"
#include "lib_kajiya_kay.glsl"
#include "lib_output.glsl"

void main()
{
  uint seed = uint(strand_seed);
  float cells = strand_along_and_occlusion.x * shading.noise_cells;
  float shift_noise = strand_noise(seed, 0u, cells);
  float sparkle_noise = strand_noise(seed, 1u, cells);
  float color_noise = strand_noise(seed, 2u, 0.0);

  vec3 tangent = unit_or(strand_tangent, vec3(0.0, 0.0, 1.0));
  vec3 normal = strand_normal(strand_point, tangent, volume_center);
  vec3 to_eye = unit_or(view.eye.xyz - view.eye.w * strand_point, normal);

  vec3 light = shading.ambient * lights.ambient_and_count.xyz;
  for (int index = 0; index < int(lights.ambient_and_count.w); index++) {
    vec3 to_light = light_direction(lights, index, strand_point);
    vec3 irradiance = light_irradiance(lights, index, strand_point);
    light += irradiance / 3.14159265358979 *
             kajiya_kay(tangent, normal, to_light, to_eye, shift_noise, sparkle_noise, shading);
  }
  vec3 radiance = light * strand_base(color_noise, shading) * strand_along_and_occlusion.y;
  color = vec4(output_encoded(radiance, output_encoding), 1.0);
}
