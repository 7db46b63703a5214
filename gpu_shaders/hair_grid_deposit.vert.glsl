// Hair among hair: deposit of CVs into the cells, vertex stage. One point per CV, in the middle of the
// texel of its cell. Blending adds whole numbers, so the sums do not depend on the order.
//
// Twin of _sums in addon/dynamics/hair_grid.py.
#include "lib_strand_texel.glsl"
#include "lib_hair_grid.glsl"

void main()
{
  int guide = gl_VertexID / CV_COUNT;
  ivec2 texel = strand_texel(guide, gl_VertexID % CV_COUNT, CV_COUNT);
  vec4 here = texelFetch(positions, texel, 0);
  vec3 before = vec3(texelFetch(previous_positions, texel, 0).xy, here.w);
  HairGridCv cv = hair_grid_cv(grid, here.xyz, before);
  mass_motion = mass_and_motion(grid, cv.motion, texelFetch(hair_at_rest, texel, 0).z);
  ivec3 cell = cv.low + ivec3(greaterThanEqual(cv.fraction, vec3(0.5)));
  gl_PointSize = 1.0;
  gl_Position = cell_clip_position(grid, wrapped_cell(cell, grid.counts.xyz));
}
