// Strands, vertex stage: one instance per strand, no vertex attributes.
//
// ADAPTIVE 0: every segment has `subdivisions` pieces. ADAPTIVE 1: instances are strands in the order of
// detail_pass.py, with stations by its factors. IN_SLOTS: instances are slots, see detail_slots.py.
//
// COVERED: ribbons of the strands' true width, extended to all pixels that they partly cover. GATHERED:
// outputs what is needed to shade a fragment later, instead of what shading needs.
// UNEVEN: points store how far along their strand they are; else they are evenly spaced.
#include "lib_strand_geometry.glsl"
#include "lib_detail_packing.glsl"
#if COVERED
#  include "lib_coverage.glsl"
#endif
#if IN_SLOTS
#  include "lib_detail_slots.glsl"
#endif

void main()
{
  int station = gl_VertexID >> 1;
  float side = float(gl_VertexID & 1) * 2.0 - 1.0;
#if ADAPTIVE
#  if IN_SLOTS
  DetailSlot slot = unpacked_slot(texelFetch(slots, counted_texel(gl_InstanceID), 0));
  int strand = slot.strand, strand_pieces = slot.pieces;
  float widening = slot.widening;
  station = slot_station(slot, station, slot_pieces);
#  else
  // x the strand, y its pieces, z factor of its width
  vec4 drawn = texelFetch(order, counted_texel(first_instance + gl_InstanceID), 0);
  int strand = int(drawn.x), strand_pieces = int(drawn.y);
  float widening = drawn.z;
#  endif
  StrandSpan span = strand_span(strand_spans, strand);
  int texels = factor_texels(span.count);
  StationSearch search = start_search(station, strand_pieces);
  for (int texel = 0; texel < texels; texel++) {
    search_factors(search, texelFetch(factors, counted_texel(span.factors + texel), 0));
  }
  int segment = search.found;
  float u = found_u(search);
#else
  int strand = gl_InstanceID;
  float widening = 1.0;
  StrandSpan span = strand_span(strand_spans, strand);
  int segment = min(station / subdivisions, span.count - 2);
  float u = float(station - segment * subdivisions) / float(subdivisions);
#endif

  int last = span.count - 1;
  ivec2 root_side = span_texel(span, segment), tip_side = span_texel(span, segment + 1);

  // xyz position, w radius
  vec4 from = texelFetch(cv_points, root_side, 0);
  vec4 to = texelFetch(cv_points, tip_side, 0);
  vec3 before = texelFetch(cv_points, span_texel(span, max(segment - 1, 0)), 0).xyz;
  vec3 after = texelFetch(cv_points, span_texel(span, min(segment + 2, last)), 0).xyz;
  // the strand is extended straight beyond its ends
  before = segment == 0 ? 2.0 * from.xyz - to.xyz : before;
  after = segment == last - 1 ? 2.0 * to.xyz - from.xyz : after;

#if UNEVEN || !GATHERED
  // x occlusion, y fraction of the length
  vec2 from_attributes = texelFetch(cv_attributes, root_side, 0).xy;
  vec2 to_attributes = texelFetch(cv_attributes, tip_side, 0).xy;
#endif

  vec3 point = catmull_rom_point(before, from.xyz, to.xyz, after, u);
  vec3 tangent = catmull_rom_tangent(before, from.xyz, to.xyz, after, u);
  float along = (float(segment) + u) / float(last);
#if DEBUG || GATHERED
  strand_place = along;
#endif
#if UNEVEN
  along = mix(from_attributes.y, to_attributes.y, u);
#endif
  float radius = mix(from.w, to.w, u) * strands.fullness;
  float taper = mix(1.0, strands.tip_width, along);

#if !GATHERED
  strand_point = point;
  strand_tangent = tangent;
  strand_along_and_occlusion = vec2(along, mix(from_attributes.x, to_attributes.x, u));
  strand_radius = radius * taper;
  strand_seed = int(texelFetch(strand_seeds, counted_texel(strand), 0).x);
#  ifdef OTHER_TAU
  strand_other_tau =
      mix(texelFetch(cv_other_tau, root_side, 0), texelFetch(cv_other_tau, tip_side, 0), u);
#  endif
#  ifdef OPENNESS
  strand_openness =
      mix(texelFetch(cv_openness, root_side, 0), texelFetch(cv_openness, tip_side, 0), u);
#  endif
#  ifdef SKIN_SEEN
  strand_received =
      mix(texelFetch(cv_received, root_side, 0), texelFetch(cv_received, tip_side, 0), u);
  strand_beneath =
      mix(texelFetch(cv_beneath, root_side, 0), texelFetch(cv_beneath, tip_side, 0), u);
#  endif
#  ifdef OWN_COLOR
  strand_own_color =
      mix(texelFetch(cv_colors, root_side, 0), texelFetch(cv_colors, tip_side, 0), u);
#  endif
#endif
#if DEBUG || GATHERED
  strand_index = strand;
#endif

  vec4 clip = view.view_projection * vec4(point, 1.0);
  vec4 clip_tangent = view.view_projection * vec4(tangent, 0.0);
  vec2 normal = ribbon_normal_at(clip, clip_tangent, view);
#if COVERED
  float half_width = pixels_wide(radius, normal, clip, view) * taper * widening;
  float reach = half_width + coverage_reach(normal);
  ribbon = vec4(side * reach, half_width, normal) * clip.w;
#else
  float minimum = strands.minimum_width * float(samples_across);
  float reach = ribbon_half_width(radius, taper, minimum, normal, clip, view) * widening;
#endif
  gl_Position = ribbon_edge(clip, normal, side, reach, view);
}
