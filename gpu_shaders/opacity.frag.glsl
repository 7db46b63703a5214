// Opacity maps, fragment stage: a strand adds to the sums of all layers that end behind it.
//
// TARGETS: number of textures, with four layers each, that are drawn into. DEEP: layers lie between the
// first and the last hair that the light meets. CARDS: cards are drawn instead of strands, with the optical
// depth of their alpha. VIEW_COMPENSATED: that depth depends on the direction of light.
#include "lib_opacity.glsl"
#ifdef CARDS
#  include "lib_card_opacity.glsl"
#  include "lib_card_texture.glsl"
#  include "lib_opacity_hidden.glsl"
#endif

void main()
{
#ifdef CARDS
  float alpha = card_texel_at(alpha_texture, card_uv, lit_level, atlas_tiles).x;
  float strand_weight = card_thickness * card_optical_depth(alpha);
#  if VIEW_COMPENSATED
  vec3 across = cross(dFdx(card_point), dFdy(card_point));
  strand_weight *= view_compensated_depth(across, normalize(card_tangent), normalize(light_direction));
#  endif
  // last, since discarded pixels give their neighbours no derivatives
  if (is_hidden_from_texels(vec3(gl_FragCoord.xy / float(opacity.resolution), strand_depth))) {
    discard;
  }
#endif
  float behind = strand_depth;
#if DEEP
  LayerSpan span = layer_span(
      opacity_spans, ivec2(gl_FragCoord.xy), map_index, opacity.resolution);
  // hair behind the last sample point in `starts` belongs to the last layer
  behind = min(layer_fraction(span, gl_FragCoord.xy, behind), 1.0);
#endif
  layers_0 = strand_weight * layers_including(behind, opacity.ends[first_texel]);
#if TARGETS > 1
  layers_1 = strand_weight * layers_including(behind, opacity.ends[first_texel + 1]);
#endif
#if TARGETS > 2
  layers_2 = strand_weight * layers_including(behind, opacity.ends[first_texel + 2]);
#endif
#if TARGETS > 3
  layers_3 = strand_weight * layers_including(behind, opacity.ends[first_texel + 3]);
#endif
#if TARGETS > 4
  layers_4 = strand_weight * layers_including(behind, opacity.ends[first_texel + 4]);
#endif
#if TARGETS > 5
  layers_5 = strand_weight * layers_including(behind, opacity.ends[first_texel + 5]);
#endif
}
