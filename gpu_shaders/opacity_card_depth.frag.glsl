// Opacity maps, fragment stage of cards: the depth of those that are not clear.
#include "lib_card_texture.glsl"

void main()
{
  vec4 steps = vec4(dFdx(card_uv), dFdy(card_uv));
  if (card_texel(alpha_texture, card_uv, steps, atlas_tiles).x < min_alpha) {
    discard;
  }
}
