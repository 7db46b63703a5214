// Strands as ribbons that face the eye: curve and width.
//
// Reference: Catmull and Rom 1974, the uniform cubic form.
// Holds no resources.
//
// A ribbon is a triangle strip with two vertices per station. Stations 0, 1, 2 ... go from root to tip;
// each segment between two CVs has as many as it has pieces:
//
//   side +1   1---3---5---7---9      gl_VertexID
//             | \ | \ | \ | \ |
//   side -1   0---2---4---6---8
//            CV 0    CV 1    CV 2    with 2 pieces each
//
// Limits: the ribbon narrows where the curve turns sharply in the picture.

#include "lib_strand_texel.glsl"

vec3 catmull_rom_point(vec3 p0, vec3 p1, vec3 p2, vec3 p3, float u)
{
  // relative to p1, which is more precise far from the world's origin
  vec3 a = p0 - p1, b = p2 - p1, c = p3 - p1;
  return p1 + 0.5 * u * (b - a + u * (2.0 * a + 4.0 * b - c + u * (c - a - 3.0 * b)));
}

// Unit tangent of the curve; direction of the chord where the derivative vanishes.
vec3 catmull_rom_tangent(vec3 p0, vec3 p1, vec3 p2, vec3 p3, float u)
{
  vec3 slope = 0.5 * (p2 - p0 + u * (2.0 * (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3) +
                                     3.0 * u * (3.0 * (p1 - p2) + p3 - p0)));
  vec3 chord = dot(p2 - p1, p2 - p1) > 0.0 ? p2 - p1 : vec3(0.0, 0.0, 1.0);
  return normalize(dot(slope, slope) > 0.0 ? slope : chord);
}

// A length across a ribbon at the clip position's depth, in pixels of the target. `normal` is the ribbon's
// in the picture, whose pixels need not be square.
float pixels_wide(float length_of, vec2 normal, vec4 clip, View view)
{
  vec2 pixels = 0.5 * vec2(view.projection[0][0], view.projection[1][1]) * view.viewport.xy;
  return length_of * length(normal * pixels) / max(abs(clip.w), 1.0e-6);
}

// Half the width of an opaque ribbon in pixels of the target: the projected radius, but no less than half
// the minimum. The taper (1 at the root) narrows even the minimum, down to one pixel of the target, below
// which an opaque ribbon breaks up.
float ribbon_half_width(
    float radius, float taper, float minimum_width, vec2 normal, vec4 clip, View view)
{
  float untapered = max(pixels_wide(radius, normal, clip, view), 0.5 * minimum_width);
  return max(untapered * taper, 0.5 * min(minimum_width, 1.0));
}

// Unit normal of the strand in the picture. `clip_tangent` is the tangent, as a direction, through the same
// matrix. The quotient rule without the division by w also works for points behind the eye.
vec2 ribbon_normal_at(vec4 clip, vec4 clip_tangent, View view)
{
  vec2 along = (clip_tangent.xy * clip.w - clip.xy * clip_tangent.w) * view.viewport.xy;
  float size = length(along);
  return size > 1.0e-20 ? vec2(-along.y, along.x) / size : vec2(1.0, 0.0);
}

// The clip position moved sideways, along the ribbon's normal in the picture.
vec4 ribbon_edge(vec4 clip, vec2 normal, float side, float half_width, View view)
{
  vec2 shift = normal * side * half_width * 2.0 / view.viewport.xy;
  return vec4(clip.xy + shift * clip.w, clip.zw);
}
