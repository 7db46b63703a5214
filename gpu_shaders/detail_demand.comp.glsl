// Sums the demand of all strands, one invocation per strand; see addon/render/detail_slots.py.
#include "lib_strand_texel.glsl"
#include "lib_detail_slots.glsl"

void main()
{
  int strand = int(gl_GlobalInvocationID.x);
  if (strand >= strand_count) {
    return;
  }
  ivec2 texel = counted_texel(strand);
  int pieces = int(texelFetch(totals, texel, 0).x);
  if (pieces == 0 || texelFetch(strand_widths, texel, 0).x <= 0.0) {
    return;
  }
  float max_fragments = 4.0e9 / float(strand_count);  // so that sums do not overflow
  vec3 fragments = min(texelFetch(strand_demand, texel, 0).yzw, vec3(max_fragments));
  imageAtomicAdd(demand, ivec2(DEMAND_SLOTS, 0), uint(slots_wanted(pieces, slot_pieces)));
  imageAtomicAdd(demand, ivec2(DEMAND_STRANDS, 0), 1u);
  imageAtomicAdd(demand, ivec2(DEMAND_FRAGMENTS, 0), uint(fragments.x));
  imageAtomicAdd(demand, ivec2(DEMAND_EDGES, 0), uint(fragments.y));
  imageAtomicAdd(demand, ivec2(DEMAND_THICK, 0), uint(fragments.z));
}
