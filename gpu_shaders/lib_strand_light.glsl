// Radiance of a strand towards the eye, from all lights and the world. SHADOWS of strands on strands come
// from opacity maps; for a light without one, from the occlusion and how much the hair's volume faces it.
// With SCATTERING light goes from strand to strand. OTHER_TAU: `other_tau` is the optical depth of hair that
// is not in the maps, for the first lights. OWN_COLOR: strands have their own colours, `own_color`, instead
// of the look's; w is 0 where a strand has none.
//
// Reads the blocks `view`, `lights`, `strands`, `shading`, `fibre`, and the textures of their features.
#include "lib_lights.glsl"
#include "lib_environment.glsl"
#include "lib_strand_noise.glsl"
#include "lib_hair_light.glsl"

#if MARSCHNER
// Level at which a highlight does not flicker. Where a strand is shaded as it is drawn, screen-space
// derivatives give the change of theta_h. With DEFERRED_SHADING neighbouring pixels may show other strands, so
// the change is computed from `bend`, the change of the tangent in a pixel.
float strand_level(
    vec3 tangent, vec3 bend, vec3 normal, vec3 to_light, vec3 to_eye, float shift_noise)
{
#  ifndef DEFERRED_SHADING
  return pixel_level(longitudinal, tangent, normal, to_light, to_eye, shift_noise, shading);
#  else
  // the derivative of theta = asin(t . w), which is unbounded where w runs along the strand
  vec2 sines = vec2(dot(tangent, to_light), dot(tangent, to_eye));
  vec2 turned = vec2(dot(bend, to_light), dot(bend, to_eye));
  vec2 angles = turned * inversesqrt(max(1.0 - sines * sines, vec2(1.0e-4)));
  return table_level(0.5 * abs(angles.x + angles.y), longitudinal);
#  endif
}
#endif

// openness, skin_seen: their vectors are in the strand's axes.
vec3 strand_radiance(vec3 point,
                     vec3 tangent,
                     vec3 bend,
                     float radius,
                     float along,
                     float occlusion,
                     vec4 openness,
                     vec4 other_tau,
                     vec4 own_color,
                     SkinSeen skin_seen,
                     uint seed)
{
  vec3 normal = strand_normal(point, tangent, volume_center);
  vec3 to_eye = unit_or(view.eye.xyz - view.eye.w * point, normal);
  float cells = along * shading.noise_cells;
  float shift_noise = strand_noise(seed, 0u, cells);
  float sparkle_noise = strand_noise(seed, 1u, cells);
  float color_noise = strand_noise(seed, 2u, 0.0);
  float grey_noise = strand_noise(seed, 3u, 0.0);
  // a brow in its natural colour (w = 2) has no tip colour either
  float tint_along = along;
#ifdef OWN_COLOR
  tint_along = own_color.w > 1.5 ? 0.0 : along;
#endif
  vec3 absorption = vec3(0.0);
#if MARSCHNER
  vec3 root = fibre.root.xyz;
#  ifdef OWN_COLOR
  root = own_color.w > 0.5 ? color_absorption(fibre, own_color.xyz) : root;
#  endif
  absorption = strand_absorption(fibre, tint_along, color_noise, grey_noise, shading, root);
  vec3 hair_color = strand_color(fibre, absorption);
#else
  vec3 root = shading.base_color;
#  ifdef OWN_COLOR
  root = own_color.w > 0.5 ? own_color.xyz : root;
#  endif
  vec3 hair_color = strand_base(tint_along, color_noise, grey_noise, shading, root);
#endif

#ifdef SKIN_SEEN
  skin_seen.received.yzw = from_axes(skin_seen.received.yzw, tangent, normal);
  skin_seen.beneath = from_axes(skin_seen.beneath, tangent, normal);
#else
  skin_seen = plane_beneath(normal);
#endif

  vec3 radiance = vec3(0.0);
#if WORLD
#  ifdef OPENNESS
  openness.yzw = from_axes(openness.yzw, tangent, normal);
#  else
  openness = openness_from_occlusion(occlusion, unit_or(point - volume_center, normal));
#  endif
  radiance = shading.ambient * hair_ambient(occlusion,
                                            openness,
                                            tangent,
                                            normal,
                                            to_eye,
                                            shift_noise,
                                            sparkle_noise,
                                            hair_color,
                                            absorption,
                                            skin_seen);
#endif
  for (int index = 0; index < int(lights.ambient_and_count.w); index++) {
    vec3 to_light, irradiance;
    light_at(lights, index, point, to_light, irradiance);
    vec3 path = shadow_path_to_strand(index, point, tangent, radius, strands.opacity);
#ifdef OTHER_TAU
    path.x += path.x >= 0.0 && index < {{other_tau_lights}} ? other_tau[index] : 0.0;
#endif
    irradiance *= path.x < 0.0 ? hair_lit_fraction(occlusion) : path.z;
    float level = 0.0;
#if MARSCHNER
    level = strand_level(tangent, bend, normal, to_light, to_eye, shift_noise);
#endif
    radiance += irradiance * hair_light(tangent,
                                        normal,
                                        to_light,
                                        to_eye,
                                        shift_noise,
                                        sparkle_noise,
                                        hair_color,
                                        absorption,
                                        level,
                                        path,
                                        skin_seen);
  }
  return radiance;
}
