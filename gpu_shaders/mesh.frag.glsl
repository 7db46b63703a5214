// Meshes, fragment stage: a Lambertian base under a microfacet boundary, and the world's light. Hair and
// meshes cast SHADOWS on them; for a light without a map of hair, the occlusion is used. OTHER_TAU: optical
// depth of hair that is not in the maps. SKIN_SHADOW: the shadow of hair is looked up in the blurred shadow map of
// the skin. PICTURES: textures replace the material's colour and bend its normals. HASHED, BLENDED: how a
// partly transparent mesh is drawn. EMISSION: it emits light.
#include "lib_lights.glsl"
#include "lib_environment.glsl"
#include "lib_facing.glsl"
#include "lib_microfacet.glsl"
#include "lib_shadows.glsl"
#include "lib_output.glsl"
#ifdef SKIN_SHADOW
#  include "lib_skin.glsl"
#endif
#ifdef HASHED
#  include "lib_hashed.glsl"
#endif

#ifdef PICTURES
// Normal from a tangent-space normal map, with axes from the derivatives of u and v (Schueler 2013,
// "Followup: Normal Mapping Without Precomputed Tangents"). Blender uses axes at vertices, which differ
// where a UV map is skewed.
vec3 bent_normal(vec3 normal, vec3 mapped, float bump)
{
  vec3 point_x = dFdx(mesh_point), point_y = dFdy(mesh_point);
  vec2 uv_x = dFdx(mesh_uv), uv_y = dFdy(mesh_uv);
  float turn = dot(cross(point_x, point_y), normal) < 0.0 ? -1.0 : 1.0;
  vec3 along_y = turn * cross(point_y, normal), along_x = turn * cross(normal, point_x);
  vec3 tangent = along_y * uv_x.x + along_x * uv_y.x;
  vec3 bitangent = along_y * uv_x.y + along_x * uv_y.y;
  float across = dot(tangent, tangent), upward = dot(bitangent, bitangent);
  if (min(across, upward) <= 0.0) {
    return normal;
  }
  // both of unit length, however the UV map is stretched, as in Blender
  vec3 bent = tangent * (mapped.x * inversesqrt(across)) + bitangent * (mapped.y * inversesqrt(upward));
  bent = normalize(bent + normal * mapped.z);
  return normalize(mix(normal, bent, bump));
}
#endif

void main()
{
  vec3 to_eye = normalize(view.eye.xyz - view.eye.w * mesh_point);
  vec3 own_normal = normalize(mesh_normal), normal = own_normal;
  vec3 facet = cross(dFdx(mesh_point), dFdy(mesh_point));
#ifdef PICTURES
  vec4 texel = texture(mesh_color_map, mesh_uv);
  vec3 base = texel.xyz;
  normal = bent_normal(normal, 2.0 * texture(mesh_normal_map, mesh_uv).xyz - 1.0, mesh_bump);
#else
  vec4 texel = vec4(1.0);
  vec3 base = mesh_color;
#endif
#if defined(HASHED) || defined(BLENDED)
  float alpha = mesh_alpha * texel.w;
#endif
#ifdef HASHED
  float hash_shift = gl_FrontFacing ? mesh_hash_shift.x : mesh_hash_shift.y;
  if (alpha <= fract(place_noise(floor(gl_FragCoord.xy)) + hash_shift)) {
    discard;
  }
#endif
  normal = facing_normal(own_normal, normal, facet, to_eye);

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
  float reflected = reflected_fraction(dot(normal, to_eye), mesh_specular, mesh_roughness);
  vec3 diffuse = base * (1.0 - reflected);
  vec3 reflected_light = radiance_from(lights, reflect(-to_eye, normal), vec2(1.0));
  vec3 radiance = (diffuse * diffuse_light(lights, normal) + reflected * reflected_light) * mesh_occlusion;
#ifdef OTHER_TAU
  vec4 other_tau = texelFetch(inter_groom_shadow, ivec2(gl_FragCoord.xy), 0);
#endif
  for (int index = 0; index < int(lights.ambient_and_count.w); index++) {
    vec3 to_light, irradiance;
    light_at(lights, index, mesh_point, to_light, irradiance);
    float facing = dot(normal, to_light);
    if (facing <= 0.0) {
      continue;
    }
    vec3 path = shadow_path(index, mesh_point);
    vec3 blurred = vec3(0.0);
    float blur_weight = 0.0;
#ifdef SKIN_SHADOW
    // where the blurred shadow is unknown, because the head's UVs overlap, the plain shadow is used
    int map = int(opacity.light[index].x);
    if (map >= 0 && map < {{skin_lights}}) {
      blurred = skin_colored(soft[map], path.x, hair_forward);
      blur_weight = min(4.0 * known, 1.0);
    }
#endif
    vec3 visibility = vec3(mesh_occlusion);
    if (blur_weight < 1.0) {
      path.z = light_past_meshes(index, mesh_point, facet, path);
      visibility *= path.z;
#if SHADOWS
      visibility = path.x < 0.0 ? visibility : transmitted_light(path, hair_forward);
#endif
    }
    visibility = mix(visibility, blurred, blur_weight);
#ifdef OTHER_TAU
    visibility *= exp((index < {{other_tau_lights}} ? -other_tau[index] : 0.0) * (1.0 - hair_forward));
#endif
    float specular = ggx_reflection(normal, to_light, to_eye, mesh_specular, mesh_roughness);
    radiance += irradiance * visibility * facing * (diffuse / PI + specular);
  }
#ifdef EMISSION
  radiance += mesh_emission;
#endif
  // a holdout writes no colour or alpha (mesh_cover is 0), but its depth
#ifdef BLENDED
  color = mesh_cover * alpha * vec4(output_encoded(radiance, output_encoding), 1.0);
#else
  color = mesh_cover * vec4(output_encoded(radiance, output_encoding), 1.0);
#endif
}
