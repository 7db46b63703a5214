// Light from one light that hair, as strands or cards, scatters to the eye, for unit irradiance: by the
// shading model that the program is compiled for, with SCATTERING also from strand to strand.
//
// Reads the blocks `shading` and `fibre`, and the textures that their features declare.
#include "lib_environment.glsl"
#include "lib_kajiya_kay.glsl"
#if MARSCHNER
#  include "lib_marschner.glsl"
#endif
#include "lib_shadows.glsl"
#include "lib_skin_seen.glsl"
#if SCATTERING
#  include "lib_dual.glsl"
#endif

// hair: its colour, for Kajiya-Kay. absorption, level: for Marschner, see lib_marschner.glsl. path: see
// shadow_path.
vec3 hair_light(vec3 tangent,
                vec3 normal,
                vec3 to_light,
                vec3 to_eye,
                float shift_noise,
                float sparkle_noise,
                vec3 hair,
                vec3 absorption,
                float level,
                vec3 path,
                SkinSeen skin_seen)
{
#if SCATTERING
  return scattering_light(longitudinal,
                          azimuthal,
                          paths,
                          fractions_forward,
                          fractions_backward,
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
                          path.x,
                          path.y,
                          scatter_density,
                          skin_color,
                          skin_seen);
#elif MARSCHNER
  return marschner_light(longitudinal,
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
                         path.x);
#else
  return (path.x < 0.0 ? 1.0 : exp(-path.x)) * hair / PI *
         kajiya_kay(tangent, normal, to_light, to_eye, shift_noise, sparkle_noise, shading);
#endif
}

// The fraction of a light without a shadow map that arrives. Scheuermann multiplies Kajiya-Kay's model by
// the occlusion itself.
float hair_lit_fraction(float occlusion)
{
#if MARSCHNER
  return lit_fraction(occlusion);
#else
  return occlusion;
#endif
}

#if WORLD
// Light from the world that hair scatters to the eye. Marschner's model takes it as eight lights;
// Kajiya-Kay's shades a matt surface, shadowed by ambient occlusion alone.
//
// openness: see path_from_openness.
vec3 hair_ambient(float occlusion,
                  vec4 openness,
                  vec3 tangent,
                  vec3 normal,
                  vec3 to_eye,
                  float shift_noise,
                  float sparkle_noise,
                  vec3 hair,
                  vec3 absorption,
                  SkinSeen skin_seen)
{
#  if !MARSCHNER
  return occlusion * hair * diffuse_light(lights, normal);
#  else
  float level = table_level(OCTANT_BLUR, longitudinal);
  vec3 radiance = vec3(0.0);
  for (int octant = 0; octant < 8; octant++) {
    vec3 towards = octant_direction(octant);
    vec3 path = vec3(path_from_openness(openness, towards), 1.0);
    radiance += octant_light(lights, octant) * hair_light(tangent,
                                                          normal,
                                                          towards,
                                                          to_eye,
                                                          shift_noise,
                                                          sparkle_noise,
                                                          hair,
                                                          absorption,
                                                          level,
                                                          path,
                                                          skin_seen);
  }
  return radiance;
#  endif
}
#endif
