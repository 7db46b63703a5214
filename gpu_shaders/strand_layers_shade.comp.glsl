// Strands as layers, third step: the nodes that are seen, one an invocation. What tells a node's
// colour gives way to the colour itself: yzw, as floats' bits, times its fraction of the pixel's light.
#include "lib_layer_radiance.glsl"
#include "lib_layer_packing.glsl"

void main()
{
  ivec2 place = ivec2(gl_GlobalInvocationID.xy);
  if (place.x + place.y * {{layer_row}} >= seen_count) {
    return;
  }
  ivec2 texel = layer_texel(imageLoad(layer_seen, place).x);
  uvec4 node = imageLoad(layer_nodes, texel);
  vec3 light = uintBitsToFloat(node.y) * layer_radiance(int(node.z), layer_place(node.w));
  imageStore(layer_nodes, texel, uvec4(node.x, floatBitsToUint(light)));
}
