// Assigns slots to moving strands, one invocation per strand; see addon/render/detail_slots.py.
//
// If strands want more slots than there are, each gets one and a proportional part of the rest. If there are
// more fragments than fit, only a fraction of the strands is drawn, and wider: wide enough to make up for
// the others, or, where wide strands would not fit either, no wider than THIN_STRAND.
#include "lib_strand_texel.glsl"
#include "lib_detail_slots.glsl"

// a little less than 1, so that rounding never takes too many slots
const float NEARLY = 0.9999;

float demanded(int number)
{
  return float(imageLoad(demand, ivec2(number, 0)).x);
}

void main()
{
  int strand = int(gl_GlobalInvocationID.x);
  if (strand >= strand_count) {
    return;
  }
  ivec2 texel = counted_texel(strand);
  int pieces = int(texelFetch(totals, texel, 0).x);
  float width = texelFetch(strand_widths, texel, 0).x, half_width = texelFetch(asked, texel, 0).x;
  if (pieces == 0 || width <= 0.0) {
    return;
  }

  float fragments = demanded(DEMAND_FRAGMENTS), edges = demanded(DEMAND_EDGES), room = float(capacity);
  float kept = 1.0, widest = width;
  if (fragments > room) {
    float made_up = (room - (fragments - edges)) / max(edges, 1.0), narrow = room / demanded(DEMAND_THICK);
    kept = clamp(max(made_up, narrow), 0.0, 1.0);
    widest = made_up >= narrow ? width / kept : width * max({{thin_strand}} / half_width, 1.0);
  }
  float chance = float((uint(strand) * 2654435769u) >> 8u) / 16777216.0;
  if (chance >= kept) {
    return;
  }
  width = min(width / kept, widest);

  int wanted = slots_wanted(pieces, slot_pieces);
  float strands = demanded(DEMAND_STRANDS), more = demanded(DEMAND_SLOTS) - strands;
  float fraction = (float(slot_count) - strands) / max(more, 1.0);
  int count = fraction < 1.0 ? 1 + int(float(wanted - 1) * fraction * NEARLY) : wanted;
  count = min(count, 65535);
  int at = int(imageAtomicAdd(demand, ivec2(DEMAND_USED, 0), uint(count)));
  for (int number = 0; number < count; number++) {
    DetailSlot slot = DetailSlot(strand, number, count, pieces, width);
    imageStore(slots, counted_texel(at + number), packed_slot(slot));
  }
}
