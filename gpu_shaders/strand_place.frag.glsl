// Who is nearest, fragment stage: x the strand, y where along its points, as layer_radiance takes it.

void main()
{
  color = vec4(float(strand_index), strand_place, 0.0, 1.0);
}
