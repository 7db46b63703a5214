// Colours of the debug views: for integers, changes of length, and depths.
//
// Holds no resources.
#include "lib_strand_noise.glsl"

// Fully saturated colour of a hue in 0..1.
vec3 hue_color(float hue)
{
  vec3 away = abs(fract(hue + vec3(0.0, 2.0, 1.0) / 3.0) * 6.0 - 3.0);
  return clamp(away - 1.0, 0.0, 1.0);
}

// Colour of a detail factor of 1 to 64 by its logarithm: from dark blue over green and yellow to red.
vec3 detail_color(int pieces)
{
  float fraction = clamp(log2(float(pieces)) / 6.0, 0.0, 1.0);
  vec3 color = hue_color(0.66 * (1.0 - fraction));
  return color * mix(0.5, 1.0, sqrt(fraction));
}

// Colour of a guide or a group. Consecutive numbers are a golden section apart in hue.
vec3 index_color(int index)
{
  float hue = fract(float(index % 4096) * 0.61803398875);
  float paler = 0.45 * hash_unit(uint(index), 0u);
  return mix(hue_color(hue), vec3(1.0), paler) * (1.0 - 0.5 * hash_unit(uint(index), 1u));
}

// Colour of a segment's relative change of length: grey at its length in the style, red where it is longer
// by {{full_color_stretch}} or more, blue where it is shorter by as much.
vec3 stretch_color(float change)
{
  vec3 full = change < 0.0 ? vec3(0.05, 0.25, 1.0) : vec3(1.0, 0.1, 0.05);
  return mix(vec3(0.5), full, min(abs(change) / {{full_color_stretch}}, 1.0));
}

// Colour of a signed distance from a collider, as a multiple of the depth shown in red: blue at 10, green at
// the surface; inside from yellow to red.
vec3 depth_color(float away)
{
  return away < 0.0 ? hue_color(mix(0.16, 0.0, min(-away, 1.0))) :
                      hue_color(mix(0.33, 0.66, min(away / 10.0, 1.0)));
}
