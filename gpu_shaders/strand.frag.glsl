// Strands, fragment stage, opaque: each pixel shaded as it is drawn. DEBUG: colours of a debug view, shaded
// just enough to tell strands apart. TANGENTS: as in lib_layer_radiance.glsl.
#include "lib_kajiya_kay.glsl"
#include "lib_strand_noise.glsl"
#include "lib_output.glsl"
#if DEBUG
#  include "lib_debug_color.glsl"
#  include "lib_detail_packing.glsl"
#  include "lib_strand_texel.glsl"
#  ifdef HAS_SOLIDS
#    include "lib_signed_distance.glsl"
#  endif
#elif !defined(TANGENTS)
#  include "lib_strand_light.glsl"
#endif

#if DEBUG
int segment_of(StrandSpan span)
{
  return clamp(int(strand_place * float(span.count - 1)), 0, span.count - 2);
}

vec3 debug_color()
{
#  if DEBUG == {{debug_occlusion}}
  return vec3(strand_along_and_occlusion.y);
#  elif DEBUG == {{debug_guide}} || DEBUG == {{debug_group}}
  return index_color(int(texelFetch(debug_numbers, counted_texel(strand_index), 0).x));
#  elif DEBUG == {{debug_stretch}}
  StrandSpan span = strand_span(strand_spans, strand_index);
  int segment = segment_of(span);
  vec3 begin = texelFetch(cv_points, span_texel(span, segment), 0).xyz;
  vec3 end = texelFetch(cv_points, span_texel(span, segment + 1), 0).xyz;
  float rest = texelFetch(rest_lengths, span_texel(span, segment), 0).x;
  return stretch_color(rest > 0.0 ? distance(begin, end) / rest - 1.0 : 0.0);
#  elif DEBUG == {{debug_depth}}
#    ifdef HAS_SOLIDS
  float reach = 10.0 * full_color_depth;
  return depth_color(signed_distance(solid_at(0), strand_point, reach).w / full_color_depth);
#    else
  return vec3(0.5);
#    endif
#  elif ADAPTIVE
  StrandSpan span = strand_span(strand_spans, strand_index);
  int segment = segment_of(span);
  int texel = segment / FACTORS_IN_TEXEL;
  uvec4 words = floatBitsToUint(texelFetch(factors, counted_texel(span.factors + texel), 0));
  return detail_color(unpacked_factor(words, segment - texel * FACTORS_IN_TEXEL));
#  else
  return detail_color(subdivisions);
#  endif
}

vec3 debug_radiance(vec3 tangent, uint seed)
{
  vec3 normal = strand_normal(strand_point, tangent, volume_center);
  vec3 to_eye = unit_or(view.eye.xyz - view.eye.w * strand_point, normal);
  return debug_color() * (0.55 + 0.3 * hash_unit(seed, 0u) + 0.15 * dot(normal, to_eye));
}
#endif

void main()
{
  uint seed = uint(strand_seed);
  vec3 tangent = unit_or(strand_tangent, vec3(0.0, 0.0, 1.0));
#if DEBUG
  vec3 radiance = debug_radiance(tangent, seed);
#elif defined(TANGENTS)
  vec3 radiance = tangent;
#else
  vec2 place = strand_along_and_occlusion;
  vec4 other_tau = vec4(0.0), own_color = vec4(0.0), openness = vec4(0.0);
#  ifdef OTHER_TAU
  other_tau = strand_other_tau;
#  endif
#  ifdef OWN_COLOR
  own_color = strand_own_color;
#  endif
#  ifdef OPENNESS
  openness = strand_openness;
#  endif
  SkinSeen skin_seen = plane_beneath(vec3(0.0));
#  ifdef SKIN_SEEN
  skin_seen = SkinSeen(strand_received, strand_beneath.xyz, strand_beneath.w);
#  endif
  vec3 radiance = strand_radiance(strand_point,
                                  tangent,
                                  vec3(0.0),
                                  strand_radius,
                                  place.x,
                                  place.y,
                                  openness,
                                  other_tau,
                                  own_color,
                                  skin_seen,
                                  seed);
#endif
  color = vec4(output_encoded(radiance, output_encoding), 1.0);
}
