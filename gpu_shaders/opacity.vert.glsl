// Opacity maps, vertex stage: strands as ribbons across the light's rays, straight between CVs and
// at least a texel wide; what they cover less than that is their weight.
#include "lib_strand_texel.glsl"
#include "lib_opacity.glsl"

vec4 map_position(vec3 point)
{
  vec4 at = vec4(point, 1.0);
  float w = dot(opacity.map_w[light_index], at);
  float depth = clamp(dot(opacity.map_depth[light_index], at), 0.0, 1.0);
  return vec4(dot(opacity.map_x[light_index], at), dot(opacity.map_y[light_index], at),
              (2.0 * depth - 1.0) * w, w);
}

void main()
{
  int station = gl_VertexID >> 1;
  float side = float(gl_VertexID & 1) * 2.0 - 1.0;
  int strand = min(int((float(gl_InstanceID) + 0.5) * strand_step), strand_count - 1);
  vec4 cv = texelFetch(cv_points, strand_texel(strand, station, cv_count), 0);
  int next = min(station + 1, cv_count - 1), last = max(station - 1, 0);
  vec3 ahead = texelFetch(cv_points, strand_texel(strand, next, cv_count), 0).xyz;
  vec3 behind = texelFetch(cv_points, strand_texel(strand, last, cv_count), 0).xyz;

  vec4 clip = map_position(cv.xyz);
  vec4 from = map_position(behind), to = map_position(ahead);
  vec2 along = (to.xy * from.w - from.xy * to.w);
  float size = length(along);
  vec2 across = size > 1.0e-20 ? vec2(-along.y, along.x) / size : vec2(1.0, 0.0);

  float texels = float(opacity.resolution);
  float taper = mix(1.0, strands.tip_width, float(station) / float(cv_count - 1));
  float half_width = cv.w * strands.fullness * taper *
                     strand_breadth(opacity, light_index, clip.xyw, across);
  float drawn = max(half_width, 0.5);

  strand_weight = strand_step * strands.opacity * half_width / drawn;
  strand_depth = 0.5 * clip.z / clip.w + 0.5;
  clip.xy += across * side * drawn * 2.0 / texels * max(abs(clip.w), 1.0e-6);
  gl_Position = clip;
}
