// Radiance at a place of a strand, computed from the strand's points, for passes that first record which
// strand is where and shade the visible places later.
//
// Reads the textures of strands by name, see addon/render/strand_pass.py, and the block `strands`.
// TANGENTS: the unit tangent, from root to tip in world space, instead of the radiance.
#define DEFERRED_SHADING
#include "lib_strand_geometry.glsl"
#ifndef TANGENTS
#  include "lib_strand_light.glsl"
#endif

// Change of the tangent over one pixel, at a place of a segment.
vec3 tangent_bend(vec3 before, vec3 from, vec3 to, vec3 after, float u, vec3 tangent)
{
  vec4 clip = view.view_projection * vec4(catmull_rom_point(before, from, to, after, u), 1.0);
  vec4 moved = view.view_projection * vec4(tangent, 0.0);
  vec2 slope = (moved.xy * clip.w - clip.xy * moved.w) * 0.5 * view.viewport.xy;
  float metres = clip.w * clip.w / max(length(slope), 1.0e-20);
  float segments = min(metres / max(distance(from, to), 1.0e-20), 1.0e3);
  float ahead = clamp(segments, 1.0e-3, 1.0);
  vec3 turned = catmull_rom_tangent(before, from, to, after, u + ahead) - tangent;
  return turned * segments / ahead;
}

// `place` is 0 at the root and 1 at the tip, and grows by the same amount from each point to the next.
vec3 layer_radiance(int strand, float place)
{
  StrandSpan span = strand_span(strand_spans, strand);
  int last = span.count - 1;
  int segment = min(int(place * float(last)), last - 1);
  float u = place * float(last) - float(segment);
  ivec2 root_side = span_texel(span, segment), tip_side = span_texel(span, segment + 1);
  vec4 from_cv = texelFetch(cv_points, root_side, 0), to_cv = texelFetch(cv_points, tip_side, 0);
  vec3 from = from_cv.xyz, to = to_cv.xyz;
  vec3 before = texelFetch(cv_points, span_texel(span, max(segment - 1, 0)), 0).xyz;
  vec3 after = texelFetch(cv_points, span_texel(span, min(segment + 2, last)), 0).xyz;
  before = segment == 0 ? 2.0 * from - to : before;
  after = segment == last - 1 ? 2.0 * to - from : after;
  vec3 tangent = catmull_rom_tangent(before, from, to, after, u);
#ifdef TANGENTS
  return tangent;
#else
  vec2 from_attributes = texelFetch(cv_attributes, root_side, 0).xy;
  vec2 to_attributes = texelFetch(cv_attributes, tip_side, 0).xy;
  vec3 point = catmull_rom_point(before, from, to, after, u);
  vec3 bend = vec3(0.0);
#if MARSCHNER
  bend = tangent_bend(before, from, to, after, u, tangent);
#endif
  float occlusion = mix(from_attributes.x, to_attributes.x, u);
  float along = place;
#if UNEVEN
  along = mix(from_attributes.y, to_attributes.y, u);
#endif
  float radius = mix(from_cv.w, to_cv.w, u) * strands.fullness *
                 mix(1.0, strands.tip_width, along);
  vec4 other_tau = vec4(0.0), own_color = vec4(0.0), openness = vec4(0.0);
#ifdef OTHER_TAU
  other_tau = mix(texelFetch(cv_other_tau, root_side, 0), texelFetch(cv_other_tau, tip_side, 0), u);
#endif
#ifdef OWN_COLOR
  own_color = mix(texelFetch(cv_colors, root_side, 0), texelFetch(cv_colors, tip_side, 0), u);
#endif
#ifdef OPENNESS
  openness = mix(texelFetch(cv_openness, root_side, 0), texelFetch(cv_openness, tip_side, 0), u);
#endif
  SkinSeen skin_seen = plane_beneath(vec3(0.0));
#ifdef SKIN_SEEN
  vec4 beneath = mix(texelFetch(cv_beneath, root_side, 0), texelFetch(cv_beneath, tip_side, 0), u);
  skin_seen.received = mix(texelFetch(cv_received, root_side, 0), texelFetch(cv_received, tip_side, 0), u);
  skin_seen.beneath = beneath.xyz;
  skin_seen.depth = beneath.w;
#endif
  uint seed = uint(texelFetch(strand_seeds, counted_texel(strand), 0).x);
  return strand_radiance(
      point, tangent, bend, radius, along, occlusion, openness, other_tau, own_color, skin_seen, seed);
#endif
}
