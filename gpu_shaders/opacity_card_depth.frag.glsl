// Opacity maps, fragment stage of cards: the depth of those that are not clear.
void main()
{
  if (texture(alpha_texture, card_uv).x < least_alpha) {
    discard;
  }
}
