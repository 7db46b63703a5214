// Strands as layers, first step: each fragment that no mesh hides joins the list of its pixel. What
// it looks like is found later, for those that are seen.
#include "lib_coverage.glsl"
#include "lib_layer_packing.glsl"

layout(early_fragment_tests) in;

void main()
{
  float alpha = strands.opacity * ribbon_coverage(ribbon * gl_FragCoord.w);
  if (alpha * LAYER_ALPHA >= 0.5) {
    uint number = imageAtomicAdd(layer_count, ivec2(0), 1u) + 1u;
    if (number <= uint(capacity)) {
      uint next = imageAtomicExchange(layer_heads, ivec2(gl_FragCoord.xy), number);
      uint depth = floatBitsToUint(gl_FragCoord.z);
      uint word = packed_layer(strand_along, alpha);
      imageStore(layer_nodes, layer_texel(number), uvec4(next, depth, uint(strand_index), word));
    }
  }
  color = vec4(0.0);
}
