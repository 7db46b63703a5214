// Uniform block of hair that feels other hair, filled by addon/render/among_pass.py.
struct Among {
  ivec4 counts;     // xyz cells of the grid, w guides
  vec4 middle;      // xyz world [m], w width of a cell [m]
  vec4 into_x;      // xyz from the world to cells, w where the grid begins; so the next two
  vec4 into_y;
  vec4 into_z;
  vec4 strength;    // x push, y pull, z friction, w from a shift in cells to what a substep adds
  float speed_ratio;  // of this substep to the one before
  float whole;        // whole parts of a metre of motion
  float ahead;        // substeps of its motion ahead that a CV counts
  float unused;
  ivec4 low;          // xyz the lowest cell in which other hair counts
};
