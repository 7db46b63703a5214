// Soft shadows on skin, first step: the fraction of each light that reaches the skin at each texel of the
// head's UV map. A channel per light, by the index of its opacity map. ONLY_HAIR: meshes cast no shadows.
#include "lib_shadows.glsl"
#include "lib_skin.glsl"

vec3 corner_of(int triangle, int corner)
{
  ivec2 texel = ivec2(3 * (triangle % {{skin_triangles_across}}) + corner,
                      triangle / {{skin_triangles_across}});
  return texelFetch(skin_corners, texel, 0).xyz;
}

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, imageSize(unblurred)))) {
    return;
  }
  vec4 skin_texel = texelFetch(skin_texels, texel, 0);
  vec4 light_fractions = vec4(1.0);
  if (skin_texel.w >= 0.0) {
    int triangle = int(skin_texel.x);
    vec3 point = (1.0 - skin_texel.y - skin_texel.z) * corner_of(triangle, 0) +
                 skin_texel.y * corner_of(triangle, 1) + skin_texel.z * corner_of(triangle, 2);
    vec3 facet = cross(corner_of(triangle, 1) - corner_of(triangle, 0),
                       corner_of(triangle, 2) - corner_of(triangle, 0));
    for (int index = 0; index < light_count; index++) {
      int map = int(opacity.light[index].x);
      if (map >= 0 && map < {{skin_lights}}) {
#ifdef ONLY_HAIR
        vec3 path = vec3(shadow_path(index, point).xy, 1.0);
#else
        vec3 path = shadow_path_to_mesh(index, point, facet);
#endif
        light_fractions[map] = transmitted_light(path, vec3(skin_forward(hair_forward))).x;
      }
    }
  }
  imageStore(unblurred, texel, light_fractions);
}
