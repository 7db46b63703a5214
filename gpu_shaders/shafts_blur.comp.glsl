// Transforms to polar coordinates and blurs along the radius, from the light outwards; an invocation per ray.
// Twin of to_polar and radial_blur in addon/shading/shafts.py.
#include "lib_shafts.glsl"

void main()
{
  int ray = int(gl_GlobalInvocationID.x);
  if (ray >= shafts.angles) {
    return;
  }
  int radii = imageSize(rays).x;
  vec2 size = vec2(textureSize(caster, 0));
  float gained = 1.0 - shafts.step_decay;
  float total = shafts.start_weight;
  float weight = shafts.start_weight;
  for (int texel = 0; texel < radii; texel++) {
    vec2 place = screen_place(shafts, ray, texel);
    bool is_inside = all(greaterThanEqual(place, vec2(0.0))) && all(lessThanEqual(place, size));
    float open_fraction = is_inside ? 1.0 - bilinear_red(caster, place - 0.5, false) : 1.0;
    total = open_fraction * gained + total * shafts.step_decay;
    weight = gained + weight * shafts.step_decay;
    imageStore(rays, ivec2(texel, ray), vec4(total / weight));
  }
}
