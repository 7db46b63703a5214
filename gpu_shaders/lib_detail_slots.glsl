// Slots of moving strands. Every slot is drawn with the same number of pieces, slot_pieces: consecutive
// pieces of a strand, or, where a strand has fewer slots than it needs, longer steps along it. A texel: x
// the strand; y number of the slot within the strand in the low 16 bits, the strand's slot count in the
// high ones; z pieces of the strand; w factor on its width, as float bits. All 0 is an unused slot.
//
// Holds no resources.

// Sums over all strands: slots wanted, strands drawn, an upper bound of their fragments, the same at zero
// width, the same with no strand thinner than THIN_STRAND, and slots in use.
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

// Station of the strand at a station of a slot with slot_pieces pieces; the last slot ends at the tip or
// beyond.
int slot_station(DetailSlot slot, int station, int slot_pieces)
{
  int step = slot.number * slot_pieces + station, steps = slot.count * slot_pieces;
  return steps >= slot.pieces ? step : int(float(step) * float(slot.pieces) / float(steps) + 0.5);
}
