// Uniform block of the grid in which hair feels other hair, filled by addon/render/hair_grid_pass.py.
struct HairGrid {
  ivec4 counts;           // xyz cells of the grid, w guides
  vec4 middle;            // xyz world [m], w width of a cell [m]
  vec4 to_cells_x;        // xyz row of the matrix from the world to cells, w offset [cells]; so the next two
  vec4 to_cells_y;
  vec4 to_cells_z;
  vec4 strength;          // x pressure, y cohesion, z friction, w factor from a shift in cells to a push per
                           // substep
  float speed_ratio;      // length of this substep over that of the one before
  float units_per_metre;  // whole numbers per metre of motion, see MOTION_UNITS
  float look_ahead;       // substeps by which a CV is moved ahead for the look-up
  float unused;
  ivec4 lowest_cell;      // xyz the lowest cell in which other hair counts
};
