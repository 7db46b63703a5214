// Strands as layers, second step, one invocation a pixel that has hair. Its list becomes that of what
// is seen: the nearest LAYERS in order, as far as enough light comes from behind them. In place of its
// depth a node has the share of its colour in the pixel's light; what lies deeper covers as much as it
// does, in the mean colour of those that are seen. `layer_seen` has the numbers of all that are left.
//
// Twin of over_nearest in addon/shading/volume/transparency.py.
#include "lib_layer_packing.glsl"

struct Layer {
  uint depth, strand, word, number;
};

// Nearest first. Depths of equal layers are floats' bits, which order as the floats do above 0. Where
// two are equal, what belongs to the strands decides, not when they were drawn.
bool is_before(Layer one, Layer other)
{
  return one.depth != other.depth ? one.depth < other.depth :
         one.word != other.word   ? one.word < other.word :
                                    one.strand < other.strand;
}

void main()
{
  ivec2 place = ivec2(gl_GlobalInvocationID.xy);
  int width = imageSize(layer_pixels).x;
  if (place.x >= width || place.x + place.y * width >= pixel_count) {
    return;
  }
  uint packed_pixel = imageLoad(layer_pixels, place).x;
  ivec2 pixel = ivec2(int(packed_pixel & 0xFFFFu), int(packed_pixel >> 16u));
  Layer nearest[LAYERS];
  for (int i = 0; i < LAYERS; i++) {
    nearest[i] = Layer(0xFFFFFFFFu, 0u, 0u, 0u);
  }
  float behind_all = 1.0;
  uint number = imageLoad(layer_heads, pixel).x;
  while (number != 0u) {
    uvec4 node = imageLoad(layer_nodes, layer_texel(number));
    Layer found = Layer(node.y, node.z, node.w, number);
    behind_all *= 1.0 - layer_alpha(node.w);
    for (int i = 0; i < LAYERS; i++) {
      Layer kept = nearest[i];
      bool is_nearer = is_before(found, kept);
      nearest[i].depth = is_nearer ? found.depth : kept.depth;
      nearest[i].strand = is_nearer ? found.strand : kept.strand;
      nearest[i].word = is_nearer ? found.word : kept.word;
      nearest[i].number = is_nearer ? found.number : kept.number;
      found.depth = is_nearer ? kept.depth : found.depth;
      found.strand = is_nearer ? kept.strand : found.strand;
      found.word = is_nearer ? kept.word : found.word;
      found.number = is_nearer ? kept.number : found.number;
    }
    number = node.x;
  }

  float shares[LAYERS];
  float through = 1.0, front = 2.0;
  int seen = 0;
  for (int i = 0; i < LAYERS; i++) {
    bool is_seen = nearest[i].number != 0u && (i == 0 || through - behind_all >= {{unseen_share}});
    float alpha = is_seen ? layer_alpha(nearest[i].word) : 0.0;
    shares[i] = through * alpha;
    through *= 1.0 - alpha;
    bool is_front = is_seen && front > 1.0 && through <= 0.5;
    front = is_front ? uintBitsToFloat(nearest[i].depth) : front;
    seen = is_seen ? i + 1 : seen;
  }
  imageStore(layer_fronts, pixel, vec4(front, 1.0 - behind_all, 0.0, 0.0));
  uint first = imageAtomicAdd(layer_count, ivec2(2, 0), uint(seen)) + 1u;
  for (int i = 0; i < LAYERS; i++) {
    if (i < seen) {
      uint next = i + 1 < seen ? nearest[min(i + 1, LAYERS - 1)].number : 0u;
      uint share = floatBitsToUint(shares[i] / max(1.0 - through, 1.0e-6));
      ivec2 texel = layer_texel(nearest[i].number);
      imageStore(layer_nodes, texel, uvec4(next, share, nearest[i].strand, nearest[i].word));
      imageStore(layer_seen, layer_texel(first + uint(i)), uvec4(nearest[i].number));
    }
  }
  imageStore(layer_heads, pixel, uvec4(nearest[0].number));
}
