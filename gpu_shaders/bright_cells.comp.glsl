// Sums over cells: luminance, luminance times x and times y, and the certainty that pixels are bright.
// Twin of bright_cells in addon/shading/bright_shafts.py.
#include "lib_bright.glsl"

void main()
{
  ivec2 cell = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(cell, imageSize(cells)))) {
    return;
  }
  ivec2 first = cell * cell_side;
  ivec2 last = min(first + cell_side, textureSize(bright, 0));
  vec4 total = vec4(0.0);
  for (int y = first.y; y < last.y; y++) {
    for (int x = first.x; x < last.x; x++) {
      vec4 texel = texelFetch(bright, ivec2(x, y), 0);
      float luminance = luminance_of(texel.rgb);
      total += vec4(luminance, luminance * (vec2(x, y) + 0.5), texel.a);
    }
  }
  imageStore(cells, cell, total);
}
