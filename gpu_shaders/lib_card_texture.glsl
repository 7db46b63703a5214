// Card textures with their mip maps in one texture.
//
// Twin of addon/shading/card_texture.py: same names. Holds no resources.

// Width and height of level 0.
ivec2 picture_size(ivec2 packed_size)
{
  return ivec2((2 * (packed_size.x - 4) + 1) / 3, packed_size.y - {{card_texture_slack}});
}

ivec2 level_corner(ivec2 size, int level)
{
  int slots = size.y + {{card_texture_slack}};
  ivec2 above = ivec2(size.x + 3, slots - (slots >> max(level - 1, 0)) + 1);
  return level == 0 ? ivec2(1) : above;
}

float wanted_level(vec2 to_right, vec2 to_top, ivec2 size)
{
  to_right *= vec2(size);
  to_top *= vec2(size);
  float longest = max(dot(to_right, to_right), dot(to_top, to_top));
  return clamp(0.5 * log2(max(longest, 1.0)), 0.0, float({{card_texture_levels}} - 1));
}

vec2 within_tile(vec2 place, ivec2 texels, vec2 tiles)
{
  vec2 tile = clamp(floor(place * tiles), vec2(0.0), tiles - 1.0);
  vec2 margin = min(0.5 / vec2(texels), 0.5 / tiles);
  return clamp(place, tile / tiles + margin, (tile + 1.0) / tiles - margin);
}

// tiles: columns and rows; 0 for a texture that repeats.
vec4 texel_in_level(sampler2D packed_levels, ivec2 packed_size, vec2 place, int level, vec2 tiles)
{
  ivec2 size = picture_size(packed_size);
  ivec2 texels = max(size >> level, ivec2(1));
  vec2 moved = tiles.x > 0.0 ? within_tile(place, texels, tiles) : fract(place);
  vec2 packed_place = vec2(level_corner(size, level)) + moved * vec2(texels);
  return textureLod(packed_levels, packed_place / vec2(packed_size), 0.0);
}

vec4 card_texel_at(sampler2D packed_levels, vec2 place, float level, vec2 tiles)
{
  ivec2 packed_size = textureSize(packed_levels, 0);
  int lower = int(level);
  vec4 near_texel = texel_in_level(packed_levels, packed_size, place, lower, tiles);
  if (level == float(lower)) {
    return near_texel;
  }
  return mix(near_texel,
             texel_in_level(packed_levels, packed_size, place, lower + 1, tiles),
             level - float(lower));
}

// steps: change of place from one pixel to the next, xy to the right, zw upwards.
vec4 card_texel(sampler2D packed_levels, vec2 place, vec4 steps, vec2 tiles)
{
  ivec2 size = picture_size(textureSize(packed_levels, 0));
  return card_texel_at(packed_levels, place, wanted_level(steps.xy, steps.zw, size), tiles);
}
