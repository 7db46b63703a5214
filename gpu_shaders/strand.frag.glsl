// Strands, fragment stage: all lights and the world's. SHADOWS of strands on strands come from
// opacity maps; where a light has none, the occlusion and how much the volume faces it stand in.
// With SCATTERING light goes from strand to strand. With a DEBUG view colours that show numbers, just
// enough shaded that strands stay apart.
#include "lib_lights.glsl"
#include "lib_strand_noise.glsl"
#include "lib_kajiya_kay.glsl"
#if MARSCHNER
#  include "lib_marschner.glsl"
#endif
#include "lib_shadows.glsl"
#if SCATTERING
#  include "lib_dual.glsl"
#endif
#include "lib_output.glsl"
#if DEBUG
#  include "lib_debug_color.glsl"
#  include "lib_detail_packing.glsl"
#  include "lib_strand_texel.glsl"
#endif

#if DEBUG
vec3 debug_color()
{
#  if DEBUG != {{debug_detail}}
  return index_color(int(texelFetch(debug_numbers, strand_texel(strand_index, 0, 1), 0).x));
#  elif ADAPTIVE
  int segment = clamp(int(strand_along_and_occlusion.x * float(cv_count - 1)), 0, cv_count - 2);
  int texel = segment / FACTORS_IN_TEXEL;
  ivec2 at = strand_texel(strand_index, texel, factor_texels(cv_count));
  uvec4 words = floatBitsToUint(texelFetch(factors, at, 0));
  return detail_color(unpacked_factor(words, segment - texel * FACTORS_IN_TEXEL));
#  else
  return detail_color(subdivisions);
#  endif
}
#endif

void main()
{
  uint seed = uint(strand_seed);
  vec3 tangent = unit_or(strand_tangent, vec3(0.0, 0.0, 1.0));
  vec3 normal = strand_normal(strand_point, tangent, volume_center);
  vec3 to_eye = unit_or(view.eye.xyz - view.eye.w * strand_point, normal);
#if DEBUG
  float shade = 0.55 + 0.3 * hash_unit(seed, 0u) + 0.15 * dot(normal, to_eye);
  vec3 radiance = debug_color() * shade;
#else
  float along = strand_along_and_occlusion.x;
  float cells = along * shading.noise_cells;
  float shift_noise = strand_noise(seed, 0u, cells);
  float sparkle_noise = strand_noise(seed, 1u, cells);
  float color_noise = strand_noise(seed, 2u, 0.0);
  float grey_noise = strand_noise(seed, 3u, 0.0);
#  if MARSCHNER
  vec3 absorption = strand_absorption(fibre, along, color_noise, grey_noise, shading);
  vec3 hair = strand_color(fibre, absorption);
#  else
  vec3 hair = strand_base(along, color_noise, grey_noise, shading);
#  endif

  float occlusion = strand_along_and_occlusion.y;
  vec3 radiance = hair * shading.ambient * lights.ambient_and_count.xyz * occlusion;
  for (int index = 0; index < int(lights.ambient_and_count.w); index++) {
    vec3 to_light, irradiance;
    light_at(lights, index, strand_point, to_light, irradiance);
    vec3 way = way_of_light(index, strand_point);
    float tau = way.x;
    irradiance *= tau < 0.0 ? occlusion : way.z;
#  if MARSCHNER
    float level = pixel_level(
        longitudinal, tangent, normal, to_light, to_eye, shift_noise, shading);
#  endif
#  if SCATTERING
    radiance += irradiance * scattering_light(longitudinal,
                                              azimuthal,
                                              paths,
                                              shares_forward,
                                              shares_backward,
                                              tangent,
                                              normal,
                                              to_light,
                                              to_eye,
                                              shift_noise,
                                              sparkle_noise,
                                              absorption,
                                              fibre,
                                              shading,
                                              level,
                                              tau,
                                              way.y,
                                              scatter_density);
#  elif MARSCHNER
    radiance += irradiance * marschner_light(longitudinal,
                                             azimuthal,
                                             paths,
                                             tangent,
                                             normal,
                                             to_light,
                                             to_eye,
                                             shift_noise,
                                             sparkle_noise,
                                             absorption,
                                             fibre,
                                             shading,
                                             level,
                                             tau);
#  else
    radiance += irradiance * (tau < 0.0 ? 1.0 : exp(-tau)) * hair / LIGHT_PI *
                kajiya_kay(tangent, normal, to_light, to_eye, shift_noise, sparkle_noise, shading);
#  endif
  }
#endif
  color = vec4(output_encoded(radiance, output_encoding), 1.0);
}
