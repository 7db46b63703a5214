// For each strand in one view: the detail factors of its segments, the sum of its pieces, 0 where the head
// hides it, and its mean depth. One invocation per strand. MODE and CULLING are the choices of
// DetailSettings.
//
// COUNTED: also the demand of each strand, see addon/render/detail_slots.py: x half its mean width [pixels],
// y an upper bound of its fragments, z that bound at zero width, w that bound at a half width of THIN_STRAND
// at least.
#include "lib_strand_texel.glsl"
#include "lib_culling.glsl"
#include "lib_detail.glsl"
#include "lib_detail_packing.glsl"

#if COUNTED
// An upper bound of a segment's length in the picture [pixels].
float length_in_picture(Control control)
{
  vec2 half_size = detail_view.picture.xy;
  float max_length = 2.0 * (half_size.x + half_size.y);
  if (min(min(control.b0.w, control.b1.w), min(control.b2.w, control.b3.w)) < NEAREST) {
    return max_length;
  }
  vec2 p0 = control.b0.xy / control.b0.w, p1 = control.b1.xy / control.b1.w;
  vec2 p2 = control.b2.xy / control.b2.w, p3 = control.b3.xy / control.b3.w;
  float size = length(half_size * (p1 - p0)) + length(half_size * (p2 - p1)) + length(half_size * (p3 - p2));
  return min(size, max_length);
}

// Width in which a ribbon of zero width partly covers pixels: coverage_reach() on both sides, at most.
const float EDGES = 2.0 * 0.7072;

float pixels_covered(float segment_pixels, float half_width)
{
  return segment_pixels * (2.0 * half_width + EDGES);
}
#endif

void main()
{
  int strand = int(gl_GlobalInvocationID.x);
  if (strand >= strand_count) {
    return;
  }
  StrandSpan span = strand_span(strand_spans, strand);
  int last = span.count - 1;
  vec3 root = texelFetch(cv_points, span.first, 0).xyz;
  vec3 from = root;
  vec3 to = texelFetch(cv_points, span_texel(span, 1), 0).xyz;
  vec3 before = 2.0 * from - to;  // the strand is extended straight beyond its ends
  vec4 clip_before = detail_view.view_projection * vec4(before, 1.0);
  vec4 clip_from = detail_view.view_projection * vec4(from, 1.0);
  vec4 clip_to = detail_view.view_projection * vec4(to, 1.0);
  float angle_from = 0.0;
  int total = 0;
  float depth = clip_from.z + clip_to.z;
#if COUNTED
  float widening = texelFetch(strand_widths, counted_texel(strand), 0).x;
  float width_sum = 0.0, strand_pixels = 0.0, fragments = 0.0, thick_fragments = 0.0;
#endif
#if CULLING == {{culling_hidden}}
  uint hiding = regions_around(from, (1u << uint(detail_view.center.w)) - 1u, detail_view);
#endif

  int texels = factor_texels(span.count);
  for (int texel = 0; texel < texels; texel++) {
    uvec4 words = uvec4(0x01010101u);
    for (int index = 0; index < FACTORS_IN_TEXEL; index++) {
      int segment = texel * FACTORS_IN_TEXEL + index;
      if (segment >= last) {
        break;
      }
      vec3 after = 2.0 * to - from;
      if (segment + 2 <= last) {
        after = texelFetch(cv_points, span_texel(span, segment + 2), 0).xyz;
      }
#if CULLING == {{culling_hidden}}
      hiding = regions_around(from + (to - before) / 6.0, hiding, detail_view);
      hiding = regions_around(to - (after - from) / 6.0, hiding, detail_view);
      hiding = regions_around(to, hiding, detail_view);
      before = from;
#endif
      vec4 clip_after = detail_view.view_projection * vec4(after, 1.0);
      Control control = segment_control(clip_before, clip_from, clip_to, clip_after);

#if MODE == {{mode_adaptive}}
      float pieces_wanted = wang_pieces(
          control, detail_view.picture.xy, detail.error, float(detail.max_subdivisions));
#elif MODE == {{mode_heuristic}}
      float angle_to = angle_between(to - from, after - to);
      float pieces_wanted = heuristic_pieces(
          clip_from, clip_to, max(angle_from, angle_to), detail_view.picture.xy, detail.piece_length);
      angle_from = angle_to;
#endif
#if MODE == {{mode_fixed}}
      int pieces = detail.subdivisions;
#else
      int pieces = pieces_wanted > 1.0 ? int(min(pieces_wanted, float(detail.max_subdivisions))) : 1;
      pieces = is_outside(control) ? 1 : pieces;
#endif
      total += pieces;
#if COUNTED
      float radius = max(texelFetch(cv_points, span_texel(span, segment), 0).w,
                         texelFetch(cv_points, span_texel(span, segment + 1), 0).w);
      float min_depth = max(min(clip_from.w, clip_to.w), NEAREST);
      float half_width = widening * radius * detail_view.picture.w / min_depth;
      float segment_pixels = is_outside(control) ? 0.0 : length_in_picture(control);
      width_sum += half_width;
      strand_pixels += segment_pixels;
      fragments += pixels_covered(segment_pixels, half_width);
      thick_fragments += pixels_covered(segment_pixels, max(half_width, {{thin_strand}}));
#endif
      words[index >> 2] += uint(pieces - 1) << uint((index & 3) << 3);

      from = to;
      to = after;
      clip_before = clip_from;
      clip_from = clip_to;
      clip_to = clip_after;
      depth += segment + 2 <= last ? clip_after.z : 0.0;
    }
    imageStore(factors, counted_texel(span.factors + texel), uintBitsToFloat(words));
  }
#if CULLING == {{culling_hidden}}
  total = hiding != 0u ? 0 : total;
#elif CULLING == {{culling_away}}
  total = faces_away(root, detail_view) ? 0 : total;
#endif
#if COUNTED
  vec4 demand = vec4(width_sum / float(last), fragments, strand_pixels * EDGES, thick_fragments);
  imageStore(strand_demand, counted_texel(strand), demand);
#endif
#if MODE == {{mode_fixed}}
  depth = 0.0;  // so strands keep their order, as in the one draw where none are culled
#endif
  imageStore(totals, counted_texel(strand), vec4(float(total), depth / float(span.count), 0.0, 0.0));
}
