// A slot of a strand that moves: as many of its pieces as all slots have, or, where a strand has fewer slots
// than it needs, as many steps along it. x the strand; y which of its slots this is, in 16 bits, and how
// many it has; z pieces of the whole strand; w factor of its width, as a float's bits. All 0 is a slot
// without a strand.
//
// Holds no resources.

// What is counted of all strands: slots that they want, how many are drawn, fragments that they may have,
// of these those that they had without a width, as many as they had if none were thin, and slots in use.
const int DEMAND_SLOTS = 0, DEMAND_STRANDS = 1, DEMAND_FRAGMENTS = 2, DEMAND_EDGES = 3, DEMAND_THICK = 4;
const int DEMAND_USED = 5;

struct DetailSlot {
  int strand;
  int number;
  int count;
  int pieces;
  float widening;
};

uvec4 packed_slot(DetailSlot slot)
{
  uint place = uint(slot.number) | (uint(slot.count) << 16u);
  return uvec4(uint(slot.strand), place, uint(slot.pieces), floatBitsToUint(slot.widening));
}

DetailSlot unpacked_slot(uvec4 texel)
{
  return DetailSlot(int(texel.x), int(texel.y & 0xFFFFu), int(texel.y >> 16u), int(texel.z),
                    uintBitsToFloat(texel.w));
}

int slots_wanted(int pieces, int slot_pieces)
{
  return (pieces + slot_pieces - 1) / slot_pieces;
}

// The strand's station at one of a slot, where slots have as many pieces; the last slot ends at the tip or
// beyond.
int slot_station(DetailSlot slot, int station, int slot_pieces)
{
  int step = slot.number * slot_pieces + station, steps = slot.count * slot_pieces;
  return steps >= slot.pieces ? step : int(float(step) * float(slot.pieces) / float(steps) + 0.5);
}
