// Whether atomics of images work: each fragment's number, from 1 on, by all that passes need.
void main()
{
  uint number = imageAtomicAdd(probed, ivec2(0, 0), 1u);
  // the least of what begins at 0 stays 0 only if it is compared
  imageAtomicMin(probed, ivec2(1, 0), number);
  imageAtomicMax(probed, ivec2(2, 0), number);
  uint before = imageAtomicExchange(probed, ivec2(3, 0), number + 1u);
  imageAtomicAdd(probed, ivec2(4, 0), before);
  color = vec4(0.0);
}
