// Holes finer than pixels. Holds no resources.

// A number from 0 to 1 for each place of the target; interleaved gradient noise (Jimenez 2014).
float place_noise(vec2 place)
{
  return fract(52.9829189 * fract(dot(place, vec2(0.06711056, 0.00583715))));
}
