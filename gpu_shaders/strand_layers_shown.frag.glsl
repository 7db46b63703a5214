// Strands as layers, fourth step: writes the colour of each pixel, or, where hair hides more than half of
// what lies behind it, its depth.
#include "lib_layer_packing.glsl"
#include "lib_output.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec2 front_and_alpha = imageLoad(layer_fronts, pixel).xy;
  float front = front_and_alpha.x, alpha = front_and_alpha.y;
  vec3 light = vec3(0.0);
  uint first = imageLoad(layer_heads, pixel).x, number = writes_depth != 0 ? 0u : first;
  while (number != 0u) {
    uvec4 node = imageLoad(layer_nodes, layer_texel(number));
    light += uintBitsToFloat(node.yzw);
    number = node.x;
  }
  color = alpha * vec4(output_encoded(light, output_encoding), 1.0);
  // where there is no hair, front and alpha are undefined
  if (first == 0u || (writes_depth != 0 && front > 1.0)) {
    discard;
  }
  gl_FragDepth = front;
}
