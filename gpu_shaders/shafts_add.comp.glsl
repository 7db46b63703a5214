// Adds blurred shafts from polar coordinates, times the haze, to the picture.
// Twin of from_polar and light_shafts in addon/shading/shafts.py.
#include "lib_shafts.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(picture)))) {
    return;
  }
  vec2 away = vec2(pixel) + 0.5 - shafts.center;
  float blurred = bilinear_red(rays, polar_place(shafts, away), shafts.is_round != 0);
  float haze = exp(-length(away) * shafts.haze_decay);
  vec4 before = imageLoad(picture, pixel);
  imageStore(picture, pixel, before + vec4(shafts.radiance.rgb * (haze * blurred), 0.0));
}
