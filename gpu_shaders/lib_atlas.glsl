// Strands in an atlas: the normal of a round strand at a sample, and which samples of thin ones count.
//
// Twin of addon/cards/bake.py: same names. Holds no resources.

// Normal of a round strand seen from outside the card; `side` is -1 to 1 across it.
vec3 fibre_normal(vec3 tangent, float side)
{
  vec3 right = vec3(tangent.y, -tangent.x, 0.0);
  float size = length(right);
  right = size > 1.0e-6 ? right / size : vec3(1.0, 0.0, 0.0);
  return right * side + cross(right, tangent) * sqrt(max(1.0 - side * side, 0.0));
}

// Whether a sample of a widened ribbon counts. This fraction of the samples does, evenly spread by the R2
// sequence (Roberts 2018).
bool is_counted(uint column, uint row, uint strand, float fraction)
{
  uint place = column * {{sparse_step_x}}u + row * {{sparse_step_y}}u + strand * {{sparse_step_z}}u;
  return float(place & {{sparse_mask}}u) < fraction * float({{sparse_mask}}u + 1u);
}

// A place of the atlas, in 0..1, in the slanted sample grid of one of its blocks; twin of Block.sheared.
vec2 sheared(vec2 place, float size, vec2 start)
{
  vec2 upright = (place * size - start) * float({{atlas_samples}});
  return vec2(upright.x + upright.y / float({{atlas_samples}}) - 0.5, upright.y);
}
