// Hair among hair: deposit of other hair's CVs into the cells around the groom, vertex stage.
//
// Twin of others_in in addon/dynamics/among.py.
#include "lib_strand_texel.glsl"
#include "lib_among.glsl"

void main()
{
  ivec2 texel = counted_texel(gl_VertexID);
  vec4 here = texelFetch(other_places, texel, 0);
  ivec3 cell = ivec3(floor(among_cells(among, here.xyz) + 0.5));
  ivec3 beside = cell - among.low.xyz;
  bool is_in = all(greaterThanEqual(beside, ivec3(0))) && all(lessThan(beside, among.counts.xyz));
  lanes = among_lanes(among, texelFetch(other_steps, texel, 0).xyz, is_in ? here.w : 0.0);
  gl_PointSize = 1.0;
  gl_Position = among_place(among, among_wrapped(cell, among.counts.xyz));
}
