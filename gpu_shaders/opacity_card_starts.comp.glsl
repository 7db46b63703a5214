// Opacity maps of cards: where their layers start and end, one invocation a texel of `starts`. It
// holds the first and the last card in {{start_texels}} x {{start_texels}} texels of the map.
void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  int side = textureSize(first_cards, 0).x / {{start_texels}};
  if (at.x >= side || at.y >= side) {
    return;
  }
  float first = 1.0, last = 0.0;
  for (int i = 0; i < {{start_texels}} * {{start_texels}}; i++) {
    ivec2 texel = at * {{start_texels}} + ivec2(i % {{start_texels}}, i / {{start_texels}});
    first = min(first, texelFetch(first_cards, texel, 0).x);
    last = max(last, texelFetch(last_cards, texel, 0).x);
  }
  if (last > 0.0) {
    at.y += map_index * side;
    imageAtomicMin(starts, at, uint(first * {{start_scale}}));
    imageAtomicMin(starts, at + ivec2(side, 0), uint((1.0 - last) * {{start_scale}}));
  }
}
