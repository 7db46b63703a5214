// Hair's shadow on meshes that Blender has drawn: how much of the light hair leaves, as black that
// lies over the finished picture.
//
// SAMPLED: in place of that an image gets x what hair takes of the light on the screen and y all of it.
// Where other hair has stored its part before, hair takes a part of what that left.
//
// What a colour of the picture becomes depends on its view transform; skin stands for all.
// Blender lays what is drawn over its picture by the powers 2.2 of code values, see lib_output.glsl.
#include "lib_lights.glsl"
#include "lib_environment.glsl"
#include "lib_shadows.glsl"
#include "lib_output.glsl"

const float NO_LIGHT = {{no_light}};

#if SAMPLED
layout(early_fragment_tests) in;
#endif

// Brightness on the screen of a matt body in this light.
float shown(vec3 radiance)
{
  vec3 written = output_encoded(body_color * radiance, {{output_viewport}});
  return dot(written, vec3(0.2126, 0.7152, 0.0722));
}

void main()
{
  vec3 to_eye = view.eye.xyz - view.eye.w * mesh_point;
  vec3 normal = normalize(mesh_normal);
  normal = dot(normal, to_eye) < 0.0 ? -normal : normal;
  vec3 all_light = matt_light(lights, normal);
  vec3 left = all_light;
  for (int index = 0; index < int(lights.ambient_and_count.w); index++) {
    vec3 to_light, irradiance;
    light_at(lights, index, mesh_point, to_light, irradiance);
    vec3 path = shadow_path_to_mesh(index, mesh_point, normal);
    vec3 arriving = irradiance * max(0.0, dot(normal, to_light)) / LIGHT_PI;
    all_light += arriving * path.z;
    left += arriving * light_left(path, hair_forward);
  }
  // where there is no light at all hair takes none
  float all_shown = shown(all_light) + NO_LIGHT, left_shown = shown(left) + NO_LIGHT;
#if SAMPLED
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec2 before = imageLoad(taken_and_all, pixel).xy;
  float fraction = (before.y > 0.0 ? 1.0 - before.x / before.y : 1.0) * left_shown / all_shown;
  // maps of other hair may know of more meshes in the way of light
  float most = max(before.y, all_shown);
  imageStore(taken_and_all, pixel, vec4(most * (1.0 - fraction), most, 0.0, 0.0));
  color = vec4(0.0);
#else
  color = vec4(vec3(0.0), 1.0 - left_shown / all_shown);
#endif
}
