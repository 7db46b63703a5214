// The grid in which hair feels other hair: the cell of a CV, and the texel of a cell.
//
// Twin of addon/dynamics/among.py. Holds no resources.

// A CV in the grid.
struct AmongCv {
  vec3 motion;  // world [m] in a substep
  ivec3 low;    // lowest of the eight cells whose centres surround it
  vec3 part;    // position between that cell's centre (0) and the next one's (1)
};

// Dot product with the same order of additions as in numpy.
float along_row(vec4 row, vec3 beside)
{
  return row.x * beside.x + row.y * beside.y + row.z * beside.z;
}

// A point of the world in cells.
vec3 among_cells(Among among, vec3 point)
{
  vec3 beside = point - among.middle.xyz;
  vec3 cells = vec3(along_row(among.into_x, beside), along_row(among.into_y, beside), along_row(among.into_z, beside));
  return cells + vec3(among.into_x.w, among.into_y.w, among.into_z.w);
}

AmongCv among_cv(Among among, vec3 here, vec3 before)
{
  vec3 motion = (here - before) * among.speed_ratio;
  vec3 cells = among_cells(among, here + motion * among.ahead);
  vec3 corner = floor(cells);
  return AmongCv(motion, ivec3(corner), cells - corner);
}

// x mass; yzw mass times motion, rounded to whole parts of a cell.
vec4 among_lanes(Among among, vec3 motion, float mass)
{
  vec3 whole = clamp(motion * among.whole, vec3(-{{among_limit}}), vec3({{among_limit}}));
  return vec4(mass, roundEven(whole) * mass);
}

// Cells wrapped into a periodic grid.
ivec3 among_wrapped(ivec3 cell, ivec3 counts)
{
  return cell - counts * ivec3(floor((vec3(cell) + 0.5) / vec3(counts)));
}

// Clip position of a point that adds to a cell.
vec4 among_place(Among among, ivec3 cell)
{
  ivec3 counts = among.counts.xyz;
  vec2 place = (vec2(cell.x * counts.z + cell.z, cell.y) + 0.5) / vec2(counts.x * counts.z, counts.y);
  return vec4(2.0 * place - 1.0, 0.0, 1.0);
}

int among_before(int cell, int count)
{
  return cell == 0 ? count - 1 : cell - 1;
}

int among_after(int cell, int count)
{
  return cell == count - 1 ? 0 : cell + 1;
}
