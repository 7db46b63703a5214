// Meshes, fragment stage: Lambert, the world's light, and a soft sheen (Blinn 1977) as skin has. Hair
// and meshes throw SHADOWS on them; where a light has no map, the occlusion stands in.
#include "lib_lights.glsl"
#include "lib_shadows.glsl"
#include "lib_output.glsl"

const float SHEEN_EXPONENT = 18.0;

void main()
{
  vec3 to_eye = normalize(view.eye.xyz - view.eye.w * mesh_point);
  vec3 normal = normalize(mesh_normal);
  normal = dot(normal, to_eye) < 0.0 ? reflect(normal, to_eye) : normal;

  vec3 radiance = mesh_color * lights.ambient_and_count.xyz * mesh_occlusion;
  for (int index = 0; index < int(lights.ambient_and_count.w); index++) {
    vec3 to_light, irradiance;
    light_at(lights, index, mesh_point, to_light, irradiance);
    vec3 way = way_of_light(index, mesh_point);
    irradiance *= (way.x < 0.0 ? mesh_occlusion : way.z * exp(-way.x)) / LIGHT_PI;
    float facing = max(0.0, dot(normal, to_light));
    float across = max(0.0, dot(normal, normalize(to_light + to_eye)));
    // (n + 8) / 8 keeps the sheen's energy the same whatever its sharpness
    float sheen = mesh_sheen * (SHEEN_EXPONENT + 8.0) / 8.0 * pow(across, SHEEN_EXPONENT);
    radiance += irradiance * facing * (mesh_color + sheen);
  }
  color = vec4(output_encoded(radiance, output_encoding), 1.0);
}
