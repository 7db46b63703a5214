// Cards, vertex stage. Both the pass that primes the depth and those that shade run this, and a
// later one meets depths that are EQUAL only where the same place comes out to the bit: `precise`.

void main()
{
  card_uv = uv;
#if !PRIME
  card_point = position;
  card_normal = normal;
  card_tangent = tangent;
  card_occlusion = occlusion;
  card_along = along;
#endif
  precise vec4 place = view.view_projection * vec4(position, 1.0);
  gl_Position = place;
}
