// Noise that depends on a strand's seed only, so that it stays with the strand as it moves.
//
// Twin of addon/shading/strand_noise.py, whose hash gives the same bits.
// Reference: the integer hash "lowbias32" of Wellons 2018, "Prospecting for Hash Functions".
// Holds no resources.

uint hash_integer(uint value)
{
  value ^= value >> 16u;
  value *= 0x7feb352du;
  value ^= value >> 15u;
  value *= 0x846ca68bu;
  value ^= value >> 16u;
  return value;
}

// A number in 0..1, below 1: 24 bits, so that it is exact in a float.
float hash_unit(uint seed, uint cell)
{
  return float(hash_integer(hash_integer(seed) + cell) >> 8u) * (1.0 / 16777216.0);
}

// Value noise along a strand, in 0..1. `along` counts cells from the root. The channels (0 to 3)
// of a seed (below 2^24) are independent.
float strand_noise(uint seed, uint channel, float along)
{
  uint own = seed * 4u + channel;
  float cell = floor(along);
  float inside = along - cell;
  float blend = inside * inside * (3.0 - 2.0 * inside);
  return mix(hash_unit(own, uint(cell)), hash_unit(own, uint(cell) + 1u), blend);
}
