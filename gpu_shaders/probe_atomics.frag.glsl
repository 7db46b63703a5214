// Probe of image atomics: all atomics that passes use, on numbers of the fragments.
void main()
{
  uint number = imageAtomicAdd(probed, ivec2(0, 0), 1u);
  // a minimum that begins at 0 stays 0 only if values are really compared
  imageAtomicMin(probed, ivec2(1, 0), number);
  imageAtomicMax(probed, ivec2(2, 0), number);
  uint before = imageAtomicExchange(probed, ivec2(3, 0), number + 1u);
  imageAtomicAdd(probed, ivec2(4, 0), before);
  color = vec4(0.0);
}
