// Assigns slots to moving strands, one invocation per strand; see addon/render/detail_slots.py.
//
// If strands want more slots than there are, each gets one and a proportional part of the rest. If there are
// more fragments than fit, only a fraction of the strands is drawn, and wider: wide enough to make up for
// the others, or, where wide strands would not fit either, no wider than THIN_STRAND.
#include "lib_strand_texel.glsl"
#include "lib_detail_slots.glsl"

// a little less than 1, so that rounding never takes too many slots
const float NEARLY = 0.9999;

float demand_sum(int number)
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
  float width = texelFetch(strand_widths, texel, 0).x, half_width = texelFetch(strand_demand, texel, 0).x;
  if (pieces == 0 || width <= 0.0) {
    return;
  }

  float fragments = demand_sum(DEMAND_FRAGMENTS), edges = demand_sum(DEMAND_EDGES);
  float max_fragments = float(capacity);
  float kept_fraction = 1.0, max_width = width;
  if (fragments > max_fragments) {
    float edge_fraction = (max_fragments - (fragments - edges)) / max(edges, 1.0);
    float thin_fraction = max_fragments / demand_sum(DEMAND_THICK);
    kept_fraction = clamp(max(edge_fraction, thin_fraction), 0.0, 1.0);
    max_width = edge_fraction >= thin_fraction ?
                    width / kept_fraction :
                    width * max({{thin_strand}} / half_width, 1.0);
  }
  float strand_hash = float((uint(strand) * 2654435769u) >> 8u) / 16777216.0;
  if (strand_hash >= kept_fraction) {
    return;
  }
  width = min(width / kept_fraction, max_width);

  int slots_needed = slots_wanted(pieces, slot_pieces);
  float strands = demand_sum(DEMAND_STRANDS), extra_slots = demand_sum(DEMAND_SLOTS) - strands;
  float fraction = (float(slot_count) - strands) / max(extra_slots, 1.0);
  int count = fraction < 1.0 ? 1 + int(float(slots_needed - 1) * fraction * NEARLY) : slots_needed;
  count = min(count, 65535);
  int first_slot = int(imageAtomicAdd(demand, ivec2(DEMAND_USED, 0), uint(count)));
  for (int number = 0; number < count; number++) {
    DetailSlot slot = DetailSlot(strand, number, count, pieces, width);
    imageStore(slots, counted_texel(first_slot + number), packed_slot(slot));
  }
}
