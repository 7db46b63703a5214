// The grid in which hair feels other hair: the cell of a CV, and the texel of a cell.
//
// Twin of addon/dynamics/hair_grid.py. Holds no resources.

// A CV in the grid.
struct HairGridCv {
  vec3 motion;    // world [m] in a substep
  ivec3 low;      // lowest of the eight cells whose centres surround it
  vec3 fraction;  // position between that cell's centre (0) and the next one's (1)
};

// Dot product with the same order of additions as in numpy.
float along_row(vec4 row, vec3 beside)
{
  return row.x * beside.x + row.y * beside.y + row.z * beside.z;
}

// A point of the world in cells.
vec3 hair_grid_cells(HairGrid grid, vec3 point)
{
  vec3 beside = point - grid.middle.xyz;
  vec3 cells = vec3(along_row(grid.to_cells_x, beside), along_row(grid.to_cells_y, beside), along_row(grid.to_cells_z, beside));
  return cells + vec3(grid.to_cells_x.w, grid.to_cells_y.w, grid.to_cells_z.w);
}

HairGridCv hair_grid_cv(HairGrid grid, vec3 here, vec3 before)
{
  vec3 motion = (here - before) * grid.speed_ratio;
  vec3 cells = hair_grid_cells(grid, here + motion * grid.look_ahead);
  vec3 corner = floor(cells);
  return HairGridCv(motion, ivec3(corner), cells - corner);
}

// x mass; yzw mass times motion, rounded to whole parts of a cell.
vec4 mass_and_motion(HairGrid grid, vec3 motion, float mass)
{
  vec3 whole = clamp(motion * grid.units_per_metre, vec3(-{{hair_grid_max_motion}}), vec3({{hair_grid_max_motion}}));
  return vec4(mass, roundEven(whole) * mass);
}

// Cells wrapped into a periodic grid.
ivec3 wrapped_cell(ivec3 cell, ivec3 counts)
{
  return cell - counts * ivec3(floor((vec3(cell) + 0.5) / vec3(counts)));
}

// Clip position of a point that adds to a cell.
vec4 cell_clip_position(HairGrid grid, ivec3 cell)
{
  ivec3 counts = grid.counts.xyz;
  vec2 place = (vec2(cell.x * counts.z + cell.z, cell.y) + 0.5) / vec2(counts.x * counts.z, counts.y);
  return vec4(2.0 * place - 1.0, 0.0, 1.0);
}

int cell_before(int cell, int count)
{
  return cell == 0 ? count - 1 : cell - 1;
}

int cell_after(int cell, int count)
{
  return cell == count - 1 ? 0 : cell + 1;
}
