// Transforms one bright region to polar coordinates and blurs it along the radius; one invocation per ray.
// Twin of to_polar, weights_on and radial_blur in addon/shading/.
#include "lib_shafts.glsl"

void main()
{
  int ray = int(gl_GlobalInvocationID.x);
  if (ray >= shafts.angles) {
    return;
  }
  int radii = imageSize(rays).x;
  float gained = 1.0 - shafts.step_decay;
  vec3 total = vec3(0.0);
  float weight = shafts.start_weight;
  for (int texel = 0; texel < radii; texel++) {
    vec2 place = screen_place(shafts, ray, texel);
    float owned = bilinear_red(weights, place / node_spacing, false);
    vec3 shining = owned * bilinear_texel(bright, place - 0.5, false).rgb;
    total = shining * gained + total * shafts.step_decay;
    weight = gained + weight * shafts.step_decay;
    imageStore(rays, ivec2(texel, ray), vec4(total / weight, 0.0));
  }
}
