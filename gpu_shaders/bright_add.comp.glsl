// Adds blurred bright parts from polar coordinates to the picture.
// Twin of from_polar and bright_shafts in addon/shading/.
#include "lib_shafts.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(picture)))) {
    return;
  }
  vec2 place = polar_place(shafts, vec2(pixel) + 0.5 - shafts.center);
  vec3 blurred = bilinear_texel(rays, place, shafts.is_round != 0).rgb;
  vec4 before = imageLoad(picture, pixel);
  imageStore(picture, pixel, before + vec4(shafts.radiance.rgb * blurred, 0.0));
}
