// Shadow of hair on meshes, fragment stage: the fraction of light, by colour, that a matt surface still
// receives, 1 without a shadow. Light that other meshes block is left out of both sides of the fraction.
// OTHER_TAU, SKIN_SHADOW, HASHED and BLENDED as in mesh.frag.glsl; of PICTURES only alpha is used.
#include "lib_lights.glsl"
#include "lib_environment.glsl"
#include "lib_facing.glsl"
#include "lib_shadows.glsl"
#ifdef SKIN_SHADOW
#  include "lib_skin.glsl"
#endif
#ifdef HASHED
#  include "lib_hashed.glsl"
#endif

// Radiance that counts as no light [W/(m^2 sr)]; and strength of a shadow that is only rounding.
const float NO_LIGHT = 1.0e-9, NO_SHADOW = 1.0e-4;

void main()
{
#if defined(HASHED) || defined(BLENDED)
  float alpha = mesh_alpha;
#  ifdef PICTURES
  alpha *= texture(mesh_color_map, mesh_uv).w;
#  endif
#endif
#ifdef HASHED
  float hash_shift = gl_FrontFacing ? mesh_hash_shift.x : mesh_hash_shift.y;
  if (alpha <= fract(place_noise(floor(gl_FragCoord.xy)) + hash_shift)) {
    discard;
  }
#endif
  vec3 to_eye = normalize(view.eye.xyz - view.eye.w * mesh_point);
  vec3 facet = cross(dFdx(mesh_point), dFdy(mesh_point));
  vec3 normal = normalize(mesh_normal);
  normal = facing_normal(normal, normal, facet, to_eye);
#ifdef SKIN_SHADOW
  float known;
  vec4 soft = skin_soft_shadow(skin_shadow,
                               skin_texels,
                               skin_stretches,
                               skin_seams,
                               skin_shifts,
                               mesh_skin.xy,
                               round(mesh_skin.z),
                               known);
#endif
#ifdef OTHER_TAU
  vec4 other_tau = texelFetch(inter_groom_shadow, ivec2(gl_FragCoord.xy), 0);
#endif
  vec3 all_light = diffuse_light(lights, normal) * mesh_occlusion;
  vec3 shadowed_light = all_light;
  for (int index = 0; index < int(lights.ambient_and_count.w); index++) {
    vec3 to_light, irradiance;
    light_at(lights, index, mesh_point, to_light, irradiance);
    float facing = dot(normal, to_light);
    if (facing <= 0.0) {
      continue;
    }
    vec3 path = shadow_path(index, mesh_point);
    float mesh_visibility = light_past_meshes(index, mesh_point, facet, path);
    vec3 hair_transmittance = vec3(1.0);
#if SHADOWS
    hair_transmittance = transmitted_light(vec3(path.xy, 1.0), hair_forward);
#endif
#ifdef SKIN_SHADOW
    int map = int(opacity.light[index].x);
    if (map >= 0 && map < {{skin_lights}}) {
      vec3 blurred = skin_colored(soft[map], path.x, hair_forward);
      hair_transmittance = mix(hair_transmittance, blurred, min(4.0 * known, 1.0));
    }
#endif
#ifdef OTHER_TAU
    float tau = index < {{other_tau_lights}} ? other_tau[index] : 0.0;
    hair_transmittance *= exp(-tau * (1.0 - hair_forward));
#endif
    vec3 arriving = mesh_visibility * facing / PI * irradiance;
    all_light += arriving;
    shadowed_light += arriving * hair_transmittance;
  }
  vec3 fraction = shadowed_light / max(all_light, vec3(NO_LIGHT));
  // exactly 1 without a shadow, so that pictures stay unchanged there
  bvec3 is_unshadowed = greaterThan(fraction, vec3(1.0 - NO_SHADOW));
  bvec3 is_dark = lessThan(all_light, vec3(NO_LIGHT));
  color = vec4(mix(fraction, vec3(1.0), max(vec3(is_unshadowed), vec3(is_dark))), 1.0);
#ifdef BLENDED
  color *= alpha;
#endif
}
