// The frame of each strand's root on the current surface, and its motion since rest; one invocation per
// strand. The frames at rest are computed by this same program, so that the motion of a root at rest is
// exactly zero.
#include "lib_root_frame.glsl"
#include "lib_strand_texel.glsl"

void main()
{
  int strand = int(gl_GlobalInvocationID.x);
  if (strand >= strand_count) {
    return;
  }
  // first texel: xyz the triangle's vertices; second: xy barycentric coordinates of b and c
  ivec3 corner = ivec3(texelFetch(root_holds, strand_texel(strand, 0, 2), 0).xyz);
  vec2 weight = texelFetch(root_holds, strand_texel(strand, 1, 2), 0).xy;
  vec3 a = texelFetch(vertices, counted_texel(corner.x), 0).xyz;
  vec3 b = texelFetch(vertices, counted_texel(corner.y), 0).xyz;
  vec3 c = texelFetch(vertices, counted_texel(corner.z), 0).xyz;
  RootFrame now = root_frame(a, b, c, weight);

  // frames, xyz of four texels: origin, tangent, bitangent, normal
  RootFrame rest;
  rest.origin = texelFetch(rest_frames, strand_texel(strand, 0, 4), 0).xyz;
  imageStore(frames, strand_texel(strand, 0, 4), vec4(now.origin, 0.0));
  for (int axis = 0; axis < 3; axis++) {
    ivec2 texel = strand_texel(strand, axis + 1, 4);
    rest.rotation[axis] = texelFetch(rest_frames, texel, 0).xyz;
    imageStore(frames, texel, vec4(now.rotation[axis], 0.0));
  }

  RootMotion motion = root_motion(rest, now);
  for (int axis = 0; axis < 3; axis++) {
    vec4 packed_axis = vec4(motion.turn[axis], motion.shift[axis]);  // see root_motion_at
    imageStore(root_motions, strand_texel(strand, axis, 4), packed_axis);
  }
  imageStore(root_motions, strand_texel(strand, 3, 4), vec4(motion.rest_origin, 0.0));
}
