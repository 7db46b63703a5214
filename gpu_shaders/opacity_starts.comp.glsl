// Opacity maps: the depths of the first and the last hair that a light meets, one invocation per CV.
//
// `starts` is coarser than the map by {{start_texels}}, so that a few sample points of each segment, one in
// each texel, are enough; drawing all strands a second time would cost as much as the map itself. In
// `starts` maps are stacked vertically, with the first depth on the left, and 1 minus the last depth on the
// right. Depths are integers, since atomics have a minimum only for these.
#include "lib_opacity_starts.glsl"

void keep_first_and_last(vec3 place)
{
  int side = starts_side();
  ivec2 texel = ivec2(floor(place.xy * float(side)));
  if (all(greaterThanEqual(texel, ivec2(0))) && all(lessThan(texel, ivec2(side)))) {
    float depth = clamp(place.z, 0.0, 1.0);
    texel.y += map_index * side;
    imageAtomicMin(starts, texel, uint(depth * {{start_scale}}));
    imageAtomicMin(starts, texel + ivec2(side, 0), uint((1.0 - depth) * {{start_scale}}));
  }
}

void main()
{
  ivec2 point_of_strand = ivec2(gl_GlobalInvocationID.xy);
  StrandSpan span = strand_span(strand_spans, first_instance + min(point_of_strand.y, drawn_count - 1));
  if (point_of_strand.x >= span.count || point_of_strand.y >= drawn_count) {
    return;
  }
  vec3 root_side = texelFetch(cv_points, span_texel(span, max(point_of_strand.x - 1, 0)), 0).xyz;
  vec3 tip_side = texelFetch(cv_points, span_texel(span, point_of_strand.x), 0).xyz;
  StartSegment segment = start_segment(root_side, tip_side);
  for (int i = 1; i <= segment.count; i++) {
    vec3 place = mix(segment.from, segment.to, float(i) / float(segment.count));
    if (!is_hidden_from_texels(place)) {
      keep_first_and_last(place);
    }
  }
}
