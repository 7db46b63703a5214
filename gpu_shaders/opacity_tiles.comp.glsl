// Shows the layers of a light's opacity map as tiles: the transmittance behind each layer, white for 1. For
// deep layers, the first tile shows the depth at which they start, white nearest to the light.
//
// Rows of tiles run from top to bottom, with {{tile_gap}} pixels between tiles.
#include "lib_opacity.glsl"

vec4 sums_of(int texel_of_map, ivec2 texel)
{
  int layer = map_index * PASSES + texel_of_map / SLOTS;
  ivec3 array_texel = ivec3(texel, layer);
  int slot = texel_of_map % SLOTS;
#if SLOTS > 5
  if (slot == 5) {
    return texelFetch(opacity_5, array_texel, 0);
  }
#endif
#if SLOTS > 4
  if (slot == 4) {
    return texelFetch(opacity_4, array_texel, 0);
  }
#endif
#if SLOTS > 3
  if (slot == 3) {
    return texelFetch(opacity_3, array_texel, 0);
  }
#endif
#if SLOTS > 2
  if (slot == 2) {
    return texelFetch(opacity_2, array_texel, 0);
  }
#endif
#if SLOTS > 1
  if (slot == 1) {
    return texelFetch(opacity_1, array_texel, 0);
  }
#endif
  return texelFetch(opacity_0, array_texel, 0);
}

float layer_transmittance(int tile, ivec2 texel)
{
#if DEEP
  if (tile == 0) {
    LayerSpan span = layer_span(opacity_spans, texel, map_index, opacity.resolution);
    return 1.0 - layers_at(span, vec2(texel) + 0.5).x;
  }
#endif
  int layer = tile - DEEP;
  return exp(-opacity.extinction * sums_of(layer / 4, texel)[layer % 4]);
}

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), size = imageSize(tiles);
  if (any(greaterThanEqual(pixel, size))) {
    return;
  }
  int side = opacity.resolution / texels_across, pitch = side + {{tile_gap}};
  ivec2 place = ivec2(pixel.x, size.y - 1 - pixel.y);
  int tile = place.x / pitch + place.y / pitch * tile_columns;
  ivec2 texel = ivec2(place.x % pitch, side - 1 - place.y % pitch);
  float grey = 0.0, count = float(texels_across * texels_across);
  if (tile < tile_count && all(lessThan(texel, ivec2(side))) && texel.y >= 0) {
    for (int i = 0; i < texels_across * texels_across; i++) {
      ivec2 step_of = ivec2(i % texels_across, i / texels_across);
      grey += layer_transmittance(tile, texel * texels_across + step_of) / count;
    }
  }
  imageStore(tiles, pixel, vec4(vec3(grey), 1.0));
}
