// Deep opacity maps: planes through the start and the thickness of the layers in each block of texels, one
// invocation per block, from the first and the last hair of the block and its four neighbours in `starts`.
//
// Twin of LayerSpans.from_first_and_last in addon/shading/volume/opacity.py. `spans` has the layout of
// `starts`: the start of the layers on the left, their total thickness on the right.
#include "lib_opacity.glsl"

// Depth of the first or the last hair of a block, if it has any.
struct StoredDepth {
  float depth;
  bool is_there;
};

StoredDepth stored_depth_at(ivec2 block, bool is_last)
{
  if (any(lessThan(block, ivec2(0))) || any(greaterThanEqual(block, ivec2(side)))) {
    return StoredDepth(0.0, false);
  }
  ivec2 texel = block + ivec2(is_last ? side : 0, map_index * side);
  uint stored = texelFetch(starts, texel, 0).x;
  float depth = start_depth(stored);
  return StoredDepth(is_last ? 1.0 - depth : depth, stored <= uint({{start_scale}}));
}

// Slope of the depth across a block: the smaller of the slopes to both neighbours (minmod); 0 where their
// signs differ or a neighbour has no hair.
float slope(StoredDepth before, StoredDepth here, StoredDepth after)
{
  float down = here.depth - before.depth, up = after.depth - here.depth;
  bool is_slope = before.is_there && after.is_there && down * up > 0.0;
  return is_slope ? (abs(down) < abs(up) ? down : up) / float({{start_texels}}) : 0.0;
}

vec3 plane_over(ivec2 block, bool is_last)
{
  StoredDepth here = stored_depth_at(block, is_last);
  StoredDepth left = stored_depth_at(block - ivec2(1, 0), is_last);
  StoredDepth right = stored_depth_at(block + ivec2(1, 0), is_last);
  StoredDepth below = stored_depth_at(block - ivec2(0, 1), is_last);
  StoredDepth above = stored_depth_at(block + ivec2(0, 1), is_last);
  return vec3(here.depth, slope(left, here, right), slope(below, here, above));
}

void main()
{
  ivec2 block = ivec2(gl_GlobalInvocationID.xy);
  if (block.x >= side || block.y >= side) {
    return;
  }
  vec3 start = vec3(1.0, 0.0, 0.0), thickness = vec3(1.0, 0.0, 0.0);
  if (stored_depth_at(block, false).is_there) {
    start = plane_over(block, false);
    thickness = plane_over(block, true) - start;
  }
  ivec2 texel = block + ivec2(0, map_index * side);
  imageStore(spans, texel, vec4(start, 0.0));
  imageStore(spans, texel + ivec2(side, 0), vec4(thickness, 0.0));
}
