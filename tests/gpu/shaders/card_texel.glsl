#include "lib_card_texture.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  vec4 at = texelFetch(places, pixel, 0);  // xy place, z level, w 1 if the picture repeats
  vec2 tiles = at.w > 0.5 ? vec2(0.0) : vec2(4.0, 2.0);
  vec4 found;
  if (at.w > 0.5) {
    found = card_texel_at(repeated_levels, at.xy, at.z, tiles);
  }
  else {
    found = card_texel_at(tiled_levels, at.xy, at.z, tiles);
  }
  imageStore(result, pixel, found);
}
