// Hashed strands, first step: the nearest fragment of each pixel that is not discarded; a fragment stays with
// the probability of its alpha. x the strand, y the place along it, z its depth. Visible fragments are shaded
// later.
#include "lib_coverage.glsl"
#include "lib_hashed.glsl"
#include "lib_strand_noise.glsl"

void main()
{
  float alpha = strands.opacity * ribbon_coverage(ribbon * gl_FragCoord.w);
  uvec2 pixel = uvec2(gl_FragCoord.xy);
  uint own = hash_integer(hash_integer(uint(strand_index)) + pixel.x + pixel.y * {{strand_rows}}u);
  // each sample of a picture discards other fragments
  if (scrambled(2u * uint(view.viewport.z) + uint(turn), own, hash_integer(own)) >= alpha) {
    discard;
  }
  hair = vec4(float(strand_index), strand_place, gl_FragCoord.z, 1.0);
}
