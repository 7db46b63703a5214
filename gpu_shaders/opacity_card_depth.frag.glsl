// Opacity maps, depth of cards, fragment stage: discards clear pixels and those that a mesh hides.
#include "lib_card_texture.glsl"
#include "lib_opacity_hidden.glsl"

void main()
{
  vec4 steps = vec4(dFdx(card_uv), dFdy(card_uv));
  vec3 place = vec3(gl_FragCoord.xy / float(opacity.resolution), strand_depth);
  if (card_texel(alpha_texture, card_uv, steps, atlas_tiles).x < min_alpha ||
      is_hidden_from_texels(place)) {
    discard;
  }
}
