// Opacity maps, vertex stage: strands as ribbons across the light's rays, straight between CVs and at least
// a texel wide; thinner strands get a smaller weight. Stations beyond the tip are clamped to it. Hair that a
// mesh hides from the light gets no width, since no light reaches it anyway. UNEVEN: points store how far
// along their strand they are; else they are evenly spaced.
#include "lib_strand_texel.glsl"
#include "lib_opacity_hidden.glsl"

vec4 map_position(vec3 point)
{
  vec4 world = vec4(point, 1.0);
  float w = dot(opacity.map_w[light_index], world);
  float depth = clamp(dot(opacity.map_depth[light_index], world), 0.0, 1.0);
  return vec4(dot(opacity.map_x[light_index], world), dot(opacity.map_y[light_index], world),
              (2.0 * depth - 1.0) * w, w);
}

// Place in the map, xy in 0..1, and depth.
vec3 place_of(vec4 clip)
{
  return 0.5 * clip.xyz / max(clip.w, 1.0e-6) + 0.5;
}

void main()
{
  float side = float(gl_VertexID & 1) * 2.0 - 1.0;
  StrandSpan span = strand_span(strand_spans, first_instance + gl_InstanceID);
  int last = span.count - 1, station = min(gl_VertexID >> 1, last);
  vec4 cv = texelFetch(cv_points, span_texel(span, station), 0);
  vec3 ahead = texelFetch(cv_points, span_texel(span, min(station + 1, last)), 0).xyz;
  vec3 behind = texelFetch(cv_points, span_texel(span, max(station - 1, 0)), 0).xyz;
#if UNEVEN
  float along = texelFetch(cv_attributes, span_texel(span, station), 0).y;
#else
  float along = float(station) / float(last);
#endif

  vec4 clip = map_position(cv.xyz);
  vec4 from = map_position(behind), to = map_position(ahead);
  vec2 course = to.xy * from.w - from.xy * to.w;
  float size = length(course);
  vec2 across = size > 1.0e-20 ? vec2(-course.y, course.x) / size : vec2(1.0, 0.0);

  float texels = float(opacity.resolution);
  float taper = mix(1.0, strands.tip_width, along);
  float half_width = cv.w * strands.fullness * taper *
                     strand_breadth(opacity, light_index, clip.xyw, across);
  float drawn = max(half_width, 0.5);
  // a look-up also blends the texels next to those that a strand covers
  float around = (drawn + 1.0) / texels;
  bool hidden = is_hidden(place_of(clip), around) && is_hidden(place_of(from), around) &&
                is_hidden(place_of(to), around);

  strand_weight = strand_step * strands.opacity * half_width / drawn;
  strand_depth = 0.5 * clip.z / clip.w + 0.5;
  drawn = hidden ? 0.0 : drawn;
  clip.xy += across * side * drawn * 2.0 / texels * max(abs(clip.w), 1.0e-6);
  gl_Position = clip;
}
