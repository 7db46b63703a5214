// The bright part of a picture composited over its background, and the certainty that it is bright (w).
// Twin of bright_part in addon/shading/bright_shafts.py.
//
// The background has the size of the picture, or is one texel for all of it.
#include "lib_bright.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(bright)))) {
    return;
  }
  vec4 foreground = texelFetch(picture_color, pixel, 0);
  vec4 backdrop = texelFetch(background, min(pixel, textureSize(background, 0) - 1), 0);
  vec3 color = foreground.rgb + (1.0 - foreground.a) * backdrop.rgb;
  // comparisons with NaN are false
  color = vec3(color.r >= 0.0 ? min(color.r, largest) : 0.0,
               color.g >= 0.0 ? min(color.g, largest) : 0.0,
               color.b >= 0.0 ? min(color.b, largest) : 0.0);
  float luminance = luminance_of(color);
  float above = max(luminance - threshold, 0.0);
  float certainty = above > 0.0 ? above / (above + knee) : 0.0;
  float factor = above > 0.0 ? min(above * certainty, brightest) / luminance : 0.0;
  imageStore(bright, pixel, vec4(color * factor, min(2.0 * certainty, 1.0)));
}
