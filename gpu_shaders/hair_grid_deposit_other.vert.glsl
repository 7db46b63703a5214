// Hair among hair: deposit of other hair's CVs into the cells around the groom, vertex stage.
//
// Twin of neighbour_sums in addon/dynamics/hair_grid.py.
#include "lib_strand_texel.glsl"
#include "lib_hair_grid.glsl"

void main()
{
  ivec2 texel = counted_texel(gl_VertexID);
  vec4 here = texelFetch(other_positions, texel, 0);
  ivec3 cell = ivec3(floor(hair_grid_cells(grid, here.xyz) + 0.5));
  ivec3 beside = cell - grid.lowest_cell.xyz;
  bool is_in = all(greaterThanEqual(beside, ivec3(0))) && all(lessThan(beside, grid.counts.xyz));
  mass_motion = mass_and_motion(grid, texelFetch(other_motions, texel, 0).xyz, is_in ? here.w : 0.0);
  gl_PointSize = 1.0;
  gl_Position = cell_clip_position(grid, wrapped_cell(cell, grid.counts.xyz));
}
