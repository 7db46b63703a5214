// Opacity maps, depths of the first and the last strand, vertex stage: sample points of segments for depth
// tests, which replace the atomics of opacity_starts.comp.glsl. The points are the same, but a segment has
// `points_across` at most, evenly spaced.
#include "lib_opacity_starts.glsl"

const vec4 NOWHERE = vec4(2.0, 2.0, 2.0, 1.0);

void main()
{
  StrandSpan span = strand_span(strand_spans, first_instance + gl_InstanceID);
  int last = span.count - 1, point = gl_VertexID / points_across;
  vec3 root_side = texelFetch(cv_points, span_texel(span, clamp(point - 1, 0, last)), 0).xyz;
  vec3 tip_side = texelFetch(cv_points, span_texel(span, min(point, last)), 0).xyz;
  StartSegment segment = start_segment(root_side, tip_side);
  int point_count = min(segment.count, points_across), i = 1 + gl_VertexID % points_across;
  vec3 place = mix(segment.from, segment.to, float(i) / float(max(point_count, 1)));
  bool is_there = point <= last && i <= point_count && !is_hidden_from_texels(place);
  // in the middle of its texel: drivers move points a little, which might be into the next texel
  float side = float(starts_side());
  vec3 middle = vec3((floor(place.xy * side) + 0.5) / side, clamp(place.z, 0.0, 1.0));
  gl_PointSize = 1.0;
  gl_Position = is_there ? vec4(2.0 * middle - 1.0, 1.0) : NOWHERE;
}
