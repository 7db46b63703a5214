// Cards, fragment stage: strands in textures, see addon/shading/textures.py.
//
// PRIME 1: only the depth of opaque pixels. CLIPPED 1: only pixels in alpha_range; without it no pixel is
// dropped, so that the early depth test works. TANGENT_MAP 1: a map of strand directions replaces the shift
// texture. LAYERED 1: shells, see addon/cards/shells.py. NORMAL_MAP 1: a map bends the normal. PLACE_MAP 1:
// a map stores how much deeper the visible strand lies than on average. SHADOWS of hair on hair, and
// SCATTERING from strand to strand, as for strands; for a light without a map, the occlusion is used.
#include "lib_card_texture.glsl"
#if PRIME
void main()
{
  vec4 steps = sharpness * vec4(dFdx(card_uv), dFdy(card_uv));
  if (card_texel(alpha_texture, card_uv, steps, atlas_tiles).x < opaque_alpha) {
    discard;
  }
  color = vec4(0.0);
}
#else
#  include "lib_lights.glsl"
#  include "lib_environment.glsl"
#  include "lib_card.glsl"
#  include "lib_hair_light.glsl"
#  include "lib_card_shadows.glsl"
#  include "lib_output.glsl"

void main()
{
  vec3 normal = unit_or(card_normal, vec3(0.0, 0.0, 1.0));
  vec3 tangent = unit_or(card_tangent, vec3(0.0, 0.0, 1.0));
  vec3 to_eye = unit_or(view.eye.xyz - view.eye.w * card_point, normal);
  float along = card_along;
  vec4 steps = vec4(dFdx(card_uv), dFdy(card_uv));
  float alpha = card_texel(alpha_texture, card_uv, steps, atlas_tiles).x;
  vec3 across = cross(dFdx(card_point), dFdy(card_point));
#  if VIEW_COMPENSATED
  alpha = view_compensated_alpha(alpha, across, tangent, to_eye);
#  endif
  vec3 card_axis = tangent;
#  if TANGENT_MAP
  vec3 texel = card_texel(tangent_texture, card_uv, steps, atlas_tiles).xyz;
  tangent = mapped_tangent(texel, tangent, normal, shading.shift_noise);
  float shift_noise = 0.5;
#  else
  float shift_noise = card_texel(shift_texture, card_uv, steps, vec2(0.0)).x;
#  endif
#  if NORMAL_MAP
  normal = mapped_normal(card_texel(normal_texture, card_uv, steps, atlas_tiles).xyz,
                         card_axis,
                         normal);
#  endif
  vec3 base = card_texel(base_texture, card_uv, steps, atlas_tiles).xyz;
  float sparkle_noise = card_texel(noise_texture, card_uv, steps, vec2(0.0)).x;
  vec3 absorption = vec3(0.0);
#  if MARSCHNER
  vec3 colored = strand_absorption(fibre, along, 0.5, 1.5, shading, fibre.root.xyz);
  vec3 grey = strand_absorption(fibre, along, 0.5, -0.5, shading, fibre.root.xyz);
  absorption = own_absorption(mix(colored, grey, shading.grey_fraction), base, fibre.root.w);
  vec3 hair = strand_color(fibre, absorption);
#  else
  vec3 hair = card_base(along, shading) * base;
#  endif

  SkinSeen skin_seen = SkinSeen(card_received, card_beneath.xyz, card_beneath.w);
  float deeper = 0.0;
#  if PLACE_MAP
  // the map holds the outermost strands; from behind, others are visible
  if (dot(across, to_eye) * dot(across, card_normal) > 0.0) {
    deeper = 2.0 * card_texel(place_texture, card_uv, steps, atlas_tiles).x - 1.0;
  }
#  endif
  float lit_alpha = alpha;
#  if SHADOWS
  lit_alpha = card_texel_at(alpha_texture, card_uv, lit_level, atlas_tiles).x;
#  endif
  vec3 radiance = vec3(0.0);
#  if WORLD
  radiance = shading.ambient * hair_ambient(card_occlusion,
                                            card_openness,
                                            tangent,
                                            normal,
                                            to_eye,
                                            shift_noise,
                                            sparkle_noise,
                                            hair,
                                            absorption,
                                            skin_seen);
#  endif
  for (int index = 0; index < int(lights.ambient_and_count.w); index++) {
    vec3 to_light, irradiance;
    light_at(lights, index, card_point, to_light, irradiance);
    vec3 path = shadow_path_to_card(index,
                                    card_point,
                                    lit_alpha,
                                    to_light,
                                    to_eye,
                                    across,
                                    card_axis,
                                    card_depth,
                                    deeper);
    irradiance *= path.x < 0.0 ? hair_lit_fraction(card_occlusion) : path.z;
    float level = 0.0;
#  if MARSCHNER
    level = pixel_level(
        longitudinal, tangent, normal, to_light, to_eye, shift_noise, shading);
#  endif
    radiance += irradiance * hair_light(tangent,
                                        normal,
                                        to_light,
                                        to_eye,
                                        shift_noise,
                                        sparkle_noise,
                                        hair,
                                        absorption,
                                        level,
                                        path,
                                        skin_seen);
  }
  float covered = is_opaque == 1 ? 1.0 : alpha;
#  if CLIPPED
  if (alpha < alpha_range.x || alpha >= alpha_range.y) {
    discard;  // at the end, because derivatives need all pixels until then
  }
#  endif
  color = vec4(output_encoded(radiance, output_encoding) * covered, covered);
}
#endif
