// Sample points of strands for the depths of the first and the last hair in opacity maps: a few on each
// segment, at least one in each texel of `starts` that it crosses.
//
// Reads the block `opacity`, the integer `light_index` and the texture array `opacity_meshes`.
#include "lib_strand_texel.glsl"
#include "lib_opacity_hidden.glsl"

// Texels of `starts` along one side of a map.
int starts_side()
{
  return opacity.resolution / {{start_texels}};
}

bool is_ahead(vec3 point)
{
  return dot(opacity.map_w[light_index], vec4(point, 1.0)) > 0.0;
}

// A segment between two points; xyz their places in the map.
struct StartSegment {
  vec3 from;
  vec3 to;
  int count;  // sample points; 0 where it reaches behind the light
};

StartSegment start_segment(vec3 root_side, vec3 tip_side)
{
  vec3 from = map_place(opacity, light_index, root_side);
  vec3 to = map_place(opacity, light_index, tip_side);
  vec2 texels = abs(to.xy - from.xy) * float(starts_side());
  int count = clamp(int(ceil(2.0 * max(texels.x, texels.y))), 1, 2 * starts_side());
  return StartSegment(from, to, is_ahead(root_side) && is_ahead(tip_side) ? count : 0);
}
