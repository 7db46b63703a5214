// The nearest strand, fragment stage: x the strand, y the place along its points, as for layer_radiance.

void main()
{
  color = vec4(float(strand_index), strand_place, 0.0, 1.0);
}
