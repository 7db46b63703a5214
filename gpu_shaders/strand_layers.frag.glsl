// Strands as layers, first step: each fragment that no mesh hides joins the list of its pixel. The
// first one puts the pixel into the list of those that have hair. What fragments look like is found
// later, for those that are seen.
#include "lib_coverage.glsl"
#include "lib_layer_packing.glsl"

layout(early_fragment_tests) in;

void main()
{
  float alpha = strands.opacity * ribbon_coverage(ribbon * gl_FragCoord.w);
  if (alpha * LAYER_ALPHA >= 0.5) {
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
      uint word = packed_layer(strand_along, alpha);
      imageStore(layer_nodes, layer_texel(number), uvec4(next, depth, uint(strand_index), word));
    }
  }
  color = vec4(0.0);
}
