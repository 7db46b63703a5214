// Guides at the exact end of a frame. To bridge the time since the last substep, each guide is moved as a
// whole to its root, and held CVs to where they are held; IS_TURNED: turned about its root by the inherited
// rotation. IS_BLENDED: blended with its style where guides are only partly simulated. One invocation per
// CV. Defines: HAS_HELD, IS_TURNED, IS_BLENDED.
//
// Twin of grid_at_frame_end in addon/dynamics/step.py, and of blended in addon/dynamics/blend.py.
#include "lib_strand_texel.glsl"
#ifdef IS_BLENDED
#include "lib_blend.glsl"
#endif

vec3 style_at(int guide, int cv)
{
  return texelFetch(styles_now, strand_texel(guide, cv, cv_count), 0).xyz;
}

vec3 simulated_at(int guide, int cv, vec3 displacement)
{
  ivec2 texel = strand_texel(guide, cv, cv_count);
#ifdef HAS_HELD
  displacement += texelFetch(held_displacements, texel, 0).xyz;
#endif
  vec3 place = texelFetch(positions, texel, 0).xyz;
#ifdef IS_TURNED
  vec3 root = texelFetch(positions, strand_texel(guide, 0, cv_count), 0).xyz;
  vec3 beside = place - root;
  place = root + vec3(dot(turn_x, beside), dot(turn_y, beside), dot(turn_z, beside));
#endif
  return place + displacement;
}

void main()
{
  ivec2 id = ivec2(gl_GlobalInvocationID.xy);
  if (id.x >= cv_count || id.y >= guide_count) {
    return;
  }
  ivec2 root = strand_texel(id.y, 0, cv_count);
  vec3 displacement = style_at(id.y, 0) - texelFetch(positions, root, 0).xyz;
  vec3 place = simulated_at(id.y, id.x, displacement);
#ifdef IS_BLENDED
  float fraction = texelFetch(fractions, root, 0).x;
  if (fraction < 1.0) {
    place = style_at(id.y, fraction > 0.0 ? 0 : id.x);
  }
  if (fraction > 0.0 && fraction < 1.0) {
    vec3 before = simulated_at(id.y, 0, displacement);
    vec3 style_before = place;
    for (int cv = 1; cv <= id.x; cv++) {
      vec3 here = simulated_at(id.y, cv, displacement);
      vec3 style_here = style_at(id.y, cv);
      place += blended_segment(here - before, style_here - style_before, fraction);
      before = here;
      style_before = style_here;
    }
  }
#endif
  imageStore(bridged, strand_texel(id.y, id.x, cv_count), vec4(place, 0.0));
}
