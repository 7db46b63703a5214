// Sorts the list of a pixel's layers, nearest first, runs of LAYERS first, then by merging two at a time.
//
// Reads and writes the image `layer_nodes`, see lib_layer_packing.glsl.
#include "lib_layer_packing.glsl"

const uvec4 NO_LAYER = uvec4(0u, 0xFFFFFFFFu, 0xFFFFFFFFu, 0xFFFFFFFFu);

// Depths of equal layers are floats' bits, which order as the floats do above 0. Where two are equal,
// what belongs to the strands decides, not when they were drawn.
bool is_before(uvec4 one, uvec4 other)
{
  return one.y != other.y ? one.y < other.y : one.w != other.w ? one.w < other.w : one.z < other.z;
}

// The first node of two sorted lists made one.
uint merged_layers(uint one, uint other)
{
  uvec4 node = imageLoad(layer_nodes, layer_texel(one));
  uvec4 other_node = imageLoad(layer_nodes, layer_texel(other));
  uint first = 0u, last = 0u;
  uvec4 last_node = uvec4(0u);
  while (one != 0u) {
    if (is_before(other_node, node)) {
      uint number = one;
      uvec4 kept = node;
      one = other;
      node = other_node;
      other = number;
      other_node = kept;
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

// Puts a layer where it belongs among the nearest, and the farthest of these out. x of these is their own
// number.
void put_layer(inout uvec4 nearest[LAYERS], uvec4 found)
{
  for (int i = 0; i < LAYERS; i++) {
    uvec4 kept = nearest[i];
    bool is_nearer = is_before(found, kept);
    nearest[i] = is_nearer ? found : kept;
    found = is_nearer ? kept : found;
  }
}

// Takes the next LAYERS nodes from a list, and gives the first of them once they are sorted.
uint sorted_run(inout uint number)
{
  uvec4 nearest[LAYERS];
  for (int i = 0; i < LAYERS; i++) {
    nearest[i] = NO_LAYER;
  }
  for (int i = 0; i < LAYERS; i++) {
    if (number != 0u) {
      uvec4 node = imageLoad(layer_nodes, layer_texel(number));
      put_layer(nearest, uvec4(number, node.yzw));
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

// The first node of a list once it is sorted.
uint sorted_layers(uint number)
{
  // at i either none or a sorted list of 2^i runs
  uint lists[{{list_digits}}];
  int used = 0;
  while (number != 0u) {
    uint own = sorted_run(number);
    int digit = 0;
    while (digit < used && lists[digit] != 0u) {
      own = merged_layers(own, lists[digit]);
      lists[digit] = 0u;
      digit++;
    }
    lists[digit] = own;
    used = max(used, digit + 1);
  }
  uint whole = lists[0];
  for (int digit = 1; digit < used; digit++) {
    uint list = lists[digit];
    whole = whole == 0u ? list : list == 0u ? whole : merged_layers(whole, list);
  }
  return whole;
}
