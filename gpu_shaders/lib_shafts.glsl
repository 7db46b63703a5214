// Polar coordinates around a light on the screen; twin of addon/shading/shafts.py.
//
// Needs struct_shafts.glsl.

// Texel (x) and ray (y) of the grid at an offset from the light on the screen [pixels].
vec2 polar_place(Shafts grid, vec2 away)
{
  float ahead = dot(away, grid.middle_cos_sin);
  float aside = away.y * grid.middle_cos_sin.x - away.x * grid.middle_cos_sin.y;
  // at the light itself there is no angle, and none is needed
  float angle = dot(away, away) > 0.0 ? atan(aside, ahead) : 0.0;
  float row = (angle / grid.span + 0.5) * float(grid.angles) - 0.5;
  return vec2((length(away) - grid.nearest) / grid.radial_step - 0.5, row);
}

// Place on the screen of a texel of a ray [pixels].
vec2 screen_place(Shafts grid, int ray, int texel)
{
  float angle = ((float(ray) + 0.5) / float(grid.angles) - 0.5) * grid.span;
  vec2 turned = vec2(cos(angle), sin(angle));
  vec2 along = vec2(
      turned.x * grid.middle_cos_sin.x - turned.y * grid.middle_cos_sin.y,
      turned.x * grid.middle_cos_sin.y + turned.y * grid.middle_cos_sin.x);
  return grid.center + (grid.nearest + (float(texel) + 0.5) * grid.radial_step) * along;
}

// Bilinear look-up at a place in texels, in full precision where drivers filter in eight bits.
// Clamped to the edges; with `wraps`, rows repeat.
vec4 bilinear_texel(sampler2D texels, vec2 place, bool wraps)
{
  ivec2 size = textureSize(texels, 0);
  vec2 corner = floor(place);
  vec2 weight = place - corner;
  ivec2 first = ivec2(corner);
  ivec2 last = first + 1;
  int top = size.y - 1;
  ivec2 columns = clamp(ivec2(first.x, last.x), 0, size.x - 1);
  ivec2 rows = wraps ? (ivec2(first.y, last.y) + size.y) % size.y
                     : clamp(ivec2(first.y, last.y), 0, top);
  vec4 below = mix(texelFetch(texels, ivec2(columns.x, rows.x), 0),
                   texelFetch(texels, ivec2(columns.y, rows.x), 0),
                   weight.x);
  vec4 above = mix(texelFetch(texels, ivec2(columns.x, rows.y), 0),
                   texelFetch(texels, ivec2(columns.y, rows.y), 0),
                   weight.x);
  return mix(below, above, weight.y);
}

float bilinear_red(sampler2D texels, vec2 place, bool wraps)
{
  return bilinear_texel(texels, place, wraps).r;
}
