// Uniform block of the grid in which hair feels other hair, filled by addon/render/among_pass.py.
struct Among {
  ivec4 counts;     // xyz cells of the grid, w guides
  vec4 middle;      // xyz world [m], w width of a cell [m]
  vec4 into_x;      // xyz row of the matrix from the world to cells, w offset [cells]; so the next two
  vec4 into_y;
  vec4 into_z;
  vec4 strength;    // x push, y pull, z friction, w factor from a shift in cells to a push per substep
  float speed_ratio;  // length of this substep over that of the one before
  float whole;        // whole parts per metre of motion
  float ahead;        // substeps by which a CV is moved ahead for the look-up
  float unused;
  ivec4 low;          // xyz the lowest cell in which other hair counts
};
