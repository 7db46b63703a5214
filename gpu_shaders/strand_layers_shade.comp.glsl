// Strands as layers, third step: shades all visible nodes, as many as the GPU has counted, with any number of
// invocations. In yzw of a node its colour times its fraction of the pixel's light, as float bits, replaces
// the data it was shaded from.
//
// All invocations do the same number of iterations, some of them idle: a software driver fails, or is no
// faster, if idle ones leave the loop.
#include "lib_layer_radiance.glsl"
#include "lib_layer_packing.glsl"

void main()
{
  int across = int(gl_NumWorkGroups.x * gl_WorkGroupSize.x);
  int stride = across * int(gl_NumWorkGroups.y);
  int invocation = int(gl_GlobalInvocationID.x) + int(gl_GlobalInvocationID.y) * across;
  int seen_count = int(imageLoad(layer_count, ivec2(2, 0)).x);
  int begin = 0;
  do {
    bool is_seen = begin + invocation < seen_count;
    ivec2 texel = layer_texel(imageLoad(layer_seen, layer_texel(uint(begin + invocation + 1))).x);
    uvec4 node = is_seen ? imageLoad(layer_nodes, texel) : uvec4(0u);
    vec3 light = uintBitsToFloat(node.y) * layer_radiance(int(node.z), layer_place(node.w));
    if (is_seen) {
      imageStore(layer_nodes, texel, uvec4(node.x, floatBitsToUint(light)));
    }
    begin += stride;
  } while (begin < seen_count);
}
