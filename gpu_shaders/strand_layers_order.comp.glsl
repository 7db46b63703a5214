// Strands as layers, second step, one invocation per pixel with hair: reduces the pixel's list to the layers
// that are shaded, in order. These are the nearest ones, as long as enough light comes from behind them, or,
// if they are more than LAYERS, a representative sample of all. In each remaining node the depth is replaced
// by its fraction of the pixel's light, and its number is added to `layer_seen`.
//
// Lists are sorted nearest first: runs of LAYERS nodes, which are then merged in pairs.
//
// Lists longer than `longest` are counted and left unchanged.
//
// NODES_PER_ROUND: nodes per loop iteration: 1, or more for software drivers, which end a shader after 65,535
// iterations of all its loops.
//
// Twin of layer_fractions in addon/shading/volume/transparency.py.
#include "lib_layer_packing.glsl"

// Loop over a list; the body sets `node` to the next one.
#define FOR_EACH_NODE(node) while (node != 0u) for (int i = 0; i < NODES_PER_ROUND; i++) if (node != 0u)

const uvec4 NO_LAYER = uvec4(0u, 0xFFFFFFFFu, 0xFFFFFFFFu, 0xFFFFFFFFu);

// Depths are float bits, which have the order of the floats above 0. Equal depths are ordered by the strands,
// so that the order of drawing does not matter.
bool is_before(uvec4 one, uvec4 other)
{
  return one.y != other.y ? one.y < other.y : one.w != other.w ? one.w < other.w : one.z < other.z;
}

// Merge two sorted lists; returns the first node.
uint merged_layers(uint one, uint other)
{
  uvec4 node = imageLoad(layer_nodes, layer_texel(one));
  uvec4 other_node = imageLoad(layer_nodes, layer_texel(other));
  uint first = 0u, last = 0u;
  uvec4 last_node = uvec4(0u);
  FOR_EACH_NODE (one) {
    if (is_before(other_node, node)) {
      uint number = one;
      uvec4 swapped = node;
      one = other;
      node = other_node;
      other = number;
      other_node = swapped;
    }
    if (first == 0u) {
      first = one;
    }
    else if (last_node.x != one) {
      imageStore(layer_nodes, layer_texel(last), uvec4(one, last_node.yzw));
    }
    last = one;
    last_node = node;
    one = node.x;
    if (one != 0u) {
      node = imageLoad(layer_nodes, layer_texel(one));
    }
  }
  imageStore(layer_nodes, layer_texel(last), uvec4(other, last_node.yzw));
  return first;
}

// Insert a layer into the sorted nearest ones, dropping the farthest. Their x is their own number.
void insert_layer(inout uvec4 nearest[LAYERS], uvec4 found)
{
  for (int i = 0; i < LAYERS; i++) {
    uvec4 current = nearest[i];
    bool is_nearer = is_before(found, current);
    nearest[i] = is_nearer ? found : current;
    found = is_nearer ? current : found;
  }
}

// Take the next LAYERS nodes from a list and sort them; returns the first.
uint sorted_run(inout uint number)
{
  uvec4 nearest[LAYERS];
  for (int i = 0; i < LAYERS; i++) {
    nearest[i] = NO_LAYER;
  }
  for (int i = 0; i < LAYERS; i++) {
    if (number != 0u) {
      uvec4 node = imageLoad(layer_nodes, layer_texel(number));
      insert_layer(nearest, uvec4(number, node.yzw));
      number = node.x;
    }
  }
  uint next = 0u;
  for (int i = LAYERS - 1; i >= 0; i--) {
    if (nearest[i].x != 0u) {
      imageStore(layer_nodes, layer_texel(nearest[i].x), uvec4(next, nearest[i].yzw));
      next = nearest[i].x;
    }
  }
  return next;
}

// Sort a list; returns its first node.
uint sorted_layers(uint number)
{
  // lists[i]: a sorted list of 2^i runs, or 0
  uint lists[{{list_digits}}];
  int used = 0;
  while (number != 0u) {
    uint run = sorted_run(number);
    int digit = 0;
    while (digit < used && lists[digit] != 0u) {
      run = merged_layers(run, lists[digit]);
      lists[digit] = 0u;
      digit++;
    }
    lists[digit] = run;
    used = max(used, digit + 1);
  }
  uint merged = lists[0];
  for (int digit = 1; digit < used; digit++) {
    uint list = lists[digit];
    merged = merged == 0u ? list : list == 0u ? merged : merged_layers(merged, list);
  }
  return merged;
}

// The reduced list; its last node is written once the next one is known.
uint selected[LAYERS];
int selected_count = 0;
uvec4 last_node;

void select_layer(uint number, uvec4 node, float fraction)
{
  if (selected_count == LAYERS) {
    return;
  }
  if (selected_count > 0) {
    imageStore(layer_nodes, layer_texel(selected[selected_count - 1]), uvec4(number, last_node.yzw));
  }
  selected[selected_count] = number;
  last_node = uvec4(0u, floatBitsToUint(fraction), node.zw);
  selected_count++;
}

// x transmittance of all layers, y depth at which it has fallen to a half, 2 where it does not.
vec2 total_transmittance(uint sorted)
{
  float transmittance = 1.0, front = 2.0;
  uint number = sorted;
  FOR_EACH_NODE (number) {
    uvec4 node = imageLoad(layer_nodes, layer_texel(number));
    transmittance *= 1.0 - layer_alpha(node.w);
    front = front > 1.0 && transmittance <= 0.5 ? uintBitsToFloat(node.y) : front;
    number = node.x;
  }
  return vec2(transmittance, front);
}

// The light that each of LAYERS selected layers represents: layers with more light than that keep their own,
// and the others share the rest evenly.
float sample_weight(uint sorted, float covered)
{
  float threshold = covered / float(LAYERS);
  int large = 0, before = 0;
  do {
    before = large;
    large = 0;
    float remaining = covered, transmittance = 1.0;
    uint number = sorted;
    FOR_EACH_NODE (number) {
      uvec4 node = imageLoad(layer_nodes, layer_texel(number));
      float weight = transmittance * layer_alpha(node.w);
      transmittance *= 1.0 - layer_alpha(node.w);
      bool is_large = weight > threshold;
      remaining -= is_large ? weight : 0.0;
      large += is_large ? 1 : 0;
      number = node.x;
    }
    float next = remaining / float(max(LAYERS - large, 1));
    threshold = clamp(next, 1.0e-6, threshold);
  } while (large > before);
  return threshold;
}

// Keep a sample of many layers: systematic sampling by light, summed from the nearest layer on. Each time the
// sum passes the middle of another threshold, the layer there is selected.
void select_sample(uint sorted, float covered)
{
  float threshold = sample_weight(sorted, covered);
  float transmittance = 1.0, cumulative = 0.5;
  uint number = sorted;
  FOR_EACH_NODE (number) {
    uvec4 node = imageLoad(layer_nodes, layer_texel(number));
    float weight = transmittance * layer_alpha(node.w);
    transmittance *= 1.0 - layer_alpha(node.w);
    bool is_large = weight > threshold;
    cumulative += is_large ? 0.0 : weight / threshold;
    if (is_large || cumulative >= 1.0) {
      select_layer(number, node, max(weight, threshold) / covered);
      cumulative -= is_large ? 0.0 : 1.0;
    }
    number = node.x;
  }
}

void main()
{
  int at = int(gl_GlobalInvocationID.x) + int(gl_GlobalInvocationID.y) * {{layer_row}};
  if (gl_GlobalInvocationID.x >= {{layer_row}}u || at >= int(imageLoad(layer_count, ivec2(1, 0)).x)) {
    return;
  }
  int width = imageSize(layer_pixels).x;
  uint packed_pixel = imageLoad(layer_pixels, ivec2(at % width, at / width)).x;
  ivec2 pixel = ivec2(int(packed_pixel & 0xFFFFu), int(packed_pixel >> 16u));
  uint head = imageLoad(layer_heads, pixel).x;
  uvec4 nearest[LAYERS];
  for (int i = 0; i < LAYERS; i++) {
    nearest[i] = NO_LAYER;
  }
  float final_transmittance = 1.0;
  int count = 0;
  uint number = head;
  while (number != 0u) {
    uvec4 node = imageLoad(layer_nodes, layer_texel(number));
    final_transmittance *= 1.0 - layer_alpha(node.w);
    insert_layer(nearest, uvec4(number, node.yzw));
    count++;
    number = node.x;
  }
  imageAtomicMax(layer_count, ivec2(3, 0), uint(count));
  if (count > longest) {
    return;
  }

  float fractions[LAYERS];
  float transmittance = 1.0, front = 2.0;
  int seen = 0;
  for (int i = 0; i < LAYERS; i++) {
    bool is_near = i == 0 || transmittance - final_transmittance >= {{unseen_fraction}};
    bool is_seen = nearest[i].x != 0u && is_near;
    float alpha = is_seen ? layer_alpha(nearest[i].w) : 0.0;
    fractions[i] = transmittance * alpha;
    transmittance *= 1.0 - alpha;
    bool is_front = is_seen && front > 1.0 && transmittance <= 0.5;
    front = is_front ? uintBitsToFloat(nearest[i].y) : front;
    seen = is_seen ? i + 1 : seen;
  }
  if (count > LAYERS && transmittance - final_transmittance >= {{unseen_fraction}}) {
    uint sorted = sorted_layers(head);
    vec2 hidden = total_transmittance(sorted);
    select_sample(sorted, 1.0 - hidden.x);
    final_transmittance = selected_count > 0 ? hidden.x : final_transmittance;
    front = selected_count > 0 ? hidden.y : front;
  }
  // also if a software driver has ended the loops above early, after 65,535 iterations of all of them
  if (selected_count == 0) {
    for (int i = 0; i < LAYERS; i++) {
      if (i < seen) {
        select_layer(nearest[i].x, nearest[i], fractions[i] / max(1.0 - transmittance, 1.0e-6));
      }
    }
  }
  imageStore(layer_nodes, layer_texel(selected[selected_count - 1]), last_node);
  imageStore(layer_fronts, pixel, vec4(front, 1.0 - final_transmittance, 0.0, 0.0));
  imageStore(layer_heads, pixel, uvec4(selected[0]));
  // from the array: a loop over the list might end early, and nodes missing here would never get a colour
  uint first_seen = imageAtomicAdd(layer_count, ivec2(2, 0), uint(selected_count)) + 1u;
  for (int i = 0; i < LAYERS; i++) {
    if (i < selected_count) {
      imageStore(layer_seen, layer_texel(first_seen + uint(i)), uvec4(selected[i]));
    }
  }
}
