// Flattened strands in the atlas, fragment stage: one sample of the outermost strand.
//
// SPARSE 1: some strands are thinner than a sample.
#include "lib_atlas.glsl"
#include "lib_unit.glsl"

void main()
{
#if SPARSE
  uint column = uint(gl_FragCoord.x) + uint(first_column);
  uint row = uint(gl_FragCoord.y) + uint(first_row);
  if (!is_counted(column, row, uint(strand_number), depth_and_fraction.y)) {
    discard;
  }
#endif
  sample_place = vec4(along_and_side.x, strand_id, depth_and_fraction.x, base_and_occlusion.w);
  sample_tangent = vec4(unit_or(strand_tangent, vec3(0.0, 1.0, 0.0)), along_and_side.y);
  sample_base = vec4(base_and_occlusion.xyz, 1.0);
}
