// The surface's frame at the root of each strand, and its motion, which carries the strand.
//
// Twin of addon/groom/roots.py (root_frames, follow). Holds no resources.
#include "lib_strand_texel.glsl"
//
// Limits: in float32 a triangle whose first angle has a sine below 1e-6 counts as degenerate; the twin, in
// float64, still finds its normal.

struct RootFrame {
  vec3 origin;    // on the surface
  mat3 rotation;  // columns: along the triangle's first edge, bitangent, normal
};

// Rigid motion of a strand from rest to now: point + turn * (point - rest_origin) + shift.
struct RootMotion {
  vec3 rest_origin;
  mat3 turn;
  vec3 shift;
};

// The unit vector across a unit tangent that is nearest to a world axis.
vec3 across(vec3 tangent)
{
  vec3 size = abs(tangent);
  vec3 axis = vec3(0.0, 0.0, 1.0);
  if (size.x <= size.y && size.x <= size.z) {
    axis = vec3(1.0, 0.0, 0.0);
  }
  else if (size.y <= size.z) {
    axis = vec3(0.0, 1.0, 0.0);
  }
  return normalize(axis - tangent * dot(axis, tangent));
}

// The frame in a triangle a, b, c. `weight` holds the barycentric coordinates of b and c. In a triangle
// without area or first edge, world axes replace the undefined directions.
RootFrame root_frame(vec3 a, vec3 b, vec3 c, vec2 weight)
{
  vec3 edge = b - a;
  vec3 other = c - a;
  RootFrame frame;
  frame.origin = a + (weight.x * edge + weight.y * other);
  float size = length(edge);
  vec3 tangent = size > 0.0 ? edge / size : vec3(1.0, 0.0, 0.0);
  vec3 normal = cross(tangent, other);
  float sine = length(normal);
  normal = sine > 1.0e-6 * length(other) ? normal / sine : across(tangent);
  frame.rotation = mat3(tangent, cross(normal, tangent), normal);
  return frame;
}

// Stored as a change, so that a root that did not move leaves its strand bit-identical.
RootMotion root_motion(RootFrame rest, RootFrame now)
{
  RootMotion motion;
  motion.rest_origin = rest.origin;
  motion.turn = (now.rotation - rest.rotation) * transpose(rest.rotation);
  motion.shift = now.origin - rest.origin;
  return motion;
}

// The motion in four texels of a texture, as ride_roots.comp.glsl writes them: three with a column of the
// turn in xyz and a coordinate of the shift in w, then xyz the rest origin.
RootMotion root_motion_at(sampler2D motions, int number)
{
  vec4 x = texelFetch(motions, strand_texel(number, 0, 4), 0);
  vec4 y = texelFetch(motions, strand_texel(number, 1, 4), 0);
  vec4 z = texelFetch(motions, strand_texel(number, 2, 4), 0);
  RootMotion motion;
  motion.rest_origin = texelFetch(motions, strand_texel(number, 3, 4), 0).xyz;
  motion.turn = mat3(x.xyz, y.xyz, z.xyz);
  motion.shift = vec3(x.w, y.w, z.w);
  return motion;
}

vec3 follow(vec3 point, RootMotion motion)
{
  return motion.turn * (point - motion.rest_origin) + motion.shift + point;
}
