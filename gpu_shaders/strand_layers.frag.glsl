// Strands as layers, first step: adds each fragment that no mesh hides to the list of its pixel. The first
// fragment of a pixel also adds the pixel to the list of pixels with hair. Visible fragments are shaded
// later.
//
// COUNTED: instead, the heads of the lists count fragments. PARTS: only fragments of a run of pixels, row by
// row, and in a range of depths, see addon/render/pixel_parts.py.
#include "lib_coverage.glsl"
#include "lib_layer_packing.glsl"

layout(early_fragment_tests) in;

const uint MAX_COUNTED = 0x80000000u;

#if PARTS
bool is_in_part()
{
  int place = int(gl_FragCoord.x) + int(gl_FragCoord.y) * imageSize(layer_heads).x;
  int depth = clamp(floatBitsToInt(gl_FragCoord.z), 0, {{depth_end}} - 1);
  return place >= part_first && place < part_end && depth >= part_near && depth < part_far;
}
#endif

void main()
{
  color = vec4(0.0);
#if PARTS
  if (!is_in_part()) {
    return;
  }
#endif
  float alpha = strands.opacity * ribbon_coverage(ribbon * gl_FragCoord.w);
  if (alpha * LAYER_ALPHA >= 0.5) {
#if COUNTED
    imageAtomicAdd(layer_heads, ivec2(gl_FragCoord.xy), 1u);
#else
    uint number = imageAtomicAdd(layer_count, ivec2(0), 1u) + 1u;
    if (number <= uint(capacity)) {
      uvec2 pixel = uvec2(gl_FragCoord.xy);
      uint next = imageAtomicExchange(layer_heads, ivec2(pixel), number);
      if (next == 0u) {
        int at = int(imageAtomicAdd(layer_count, ivec2(1, 0), 1u));
        int width = imageSize(layer_pixels).x;
        imageStore(layer_pixels, ivec2(at % width, at / width), uvec4(pixel.x | (pixel.y << 16u)));
      }
      uint depth = floatBitsToUint(gl_FragCoord.z);
      uint word = packed_layer(strand_place, alpha);
      imageStore(layer_nodes, layer_texel(number), uvec4(next, depth, uint(strand_index), word));
    }
    else if (number > MAX_COUNTED) {
      // if the counter wrapped around to 0, lists would overwrite each other
      imageAtomicMin(layer_count, ivec2(0), MAX_COUNTED);
    }
#endif
  }
}
