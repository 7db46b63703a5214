// Brightness on the screen of a matt body with and without the shadow of hair.
//
// The view transform is not linear, so the ratio of the two depends on the body's colour; that of skin is
// taken for all bodies. Reads what both recipes of body_shadow.py declare: view, lights, maps, body_color,
// hair_forward.
#include "lib_bright.glsl"
#include "lib_lights.glsl"
#include "lib_environment.glsl"
#include "lib_facing.glsl"
#include "lib_shadows.glsl"
#include "lib_output.glsl"

const float NO_LIGHT = {{no_light}};

// Brightness on the screen of a matt body in this light.
float screen_brightness(vec3 radiance)
{
  vec3 encoded = output_encoded(body_color * radiance, {{output_viewport}});
  return luminance_of(encoded);
}

// Brightness on the screen at a place of a mesh: x without hair, y in the shadow of hair. NO_LIGHT is added
// to both, so that their ratio is 1 where there is no light.
//   facet: see facing_normal.
vec2 unshadowed_and_shadowed(vec3 point, vec3 normal, vec3 facet)
{
  normal = facing_normal(normal, normal, facet, normalize(view.eye.xyz - view.eye.w * point));
  vec3 all_light = diffuse_light(lights, normal);
  vec3 shadowed_light = all_light;
  for (int index = 0; index < int(lights.ambient_and_count.w); index++) {
    vec3 to_light, irradiance;
    light_at(lights, index, point, to_light, irradiance);
    vec3 path = shadow_path_to_mesh(index, point, normal);
    vec3 arriving = irradiance * max(0.0, dot(normal, to_light)) / PI;
    all_light += arriving * path.z;
    shadowed_light += arriving * transmitted_light(path, hair_forward);
  }
  return vec2(screen_brightness(all_light), screen_brightness(shadowed_light)) + NO_LIGHT;
}
