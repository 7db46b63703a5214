// Opacity maps, fragment stage: a strand is part of the sums of all layers that end behind it.
//
// TARGETS: textures of four layers each that are drawn into. DEEP: layers start at the first hair
// that the light meets.
#include "lib_opacity.glsl"

void main()
{
  float behind = strand_depth;
#if DEEP
  ivec2 start = ivec2(gl_FragCoord.xy) / {{start_texels}};
  start.y += map_index * (opacity.resolution / {{start_texels}});
  behind -= start_depth(texelFetch(opacity_starts, start, 0).x);
#endif
  layers_0 = strand_weight * adds_to(behind, opacity.ends[first_texel]);
#if TARGETS > 1
  layers_1 = strand_weight * adds_to(behind, opacity.ends[first_texel + 1]);
#endif
#if TARGETS > 2
  layers_2 = strand_weight * adds_to(behind, opacity.ends[first_texel + 2]);
#endif
#if TARGETS > 3
  layers_3 = strand_weight * adds_to(behind, opacity.ends[first_texel + 3]);
#endif
#if TARGETS > 4
  layers_4 = strand_weight * adds_to(behind, opacity.ends[first_texel + 4]);
#endif
#if TARGETS > 5
  layers_5 = strand_weight * adds_to(behind, opacity.ends[first_texel + 5]);
#endif
}
