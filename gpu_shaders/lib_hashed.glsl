// Hashed alpha: noise by which fragments are discarded. Holds no resources.

// A number from 0 to 1 for each pixel of the target; interleaved gradient noise (Jimenez 2014).
float place_noise(vec2 place)
{
  return fract(52.9829189 * fract(dot(place, vec2(0.06711056, 0.00583715))));
}

uint reversed_bits(uint value)
{
  value = (value << 16u) | (value >> 16u);
  value = ((value & 0x00ff00ffu) << 8u) | ((value & 0xff00ff00u) >> 8u);
  value = ((value & 0x0f0f0f0fu) << 4u) | ((value & 0xf0f0f0f0u) >> 4u);
  value = ((value & 0x33333333u) << 2u) | ((value & 0xccccccccu) >> 2u);
  return ((value & 0x55555555u) << 1u) | ((value & 0xaaaaaaaau) >> 1u);
}

// Flips each bit, or not, depending on the bits below it.
uint mixed_upwards(uint value, uint seed)
{
  value += seed;
  value ^= value * 0x6c50b47cu;
  value ^= value * 0xb82f1e52u;
  value ^= value * 0xc7afe638u;
  return value ^ (value * 0x8d22f6e6u);
}

// Element `place` of a sequence that fills 0..1 evenly. Each pair of seeds has its own order. Twin of
// `scrambled` in addon/render/hashed_alpha.py.
float scrambled(uint place, uint seed, uint other_seed)
{
  uint shuffled = reversed_bits(mixed_upwards(reversed_bits(place), seed));
  uint digits = reversed_bits(mixed_upwards(shuffled, other_seed));
  return float(digits >> 8u) * (1.0 / 16777216.0);
}
