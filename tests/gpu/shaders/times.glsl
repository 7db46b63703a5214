// Multiplies each texel of a row by a define.
void main()
{
  ivec2 at = ivec2(int(gl_GlobalInvocationID.x), 0);
  if (at.x >= imageSize(numbers).x) {
    return;
  }
  imageStore(numbers, at, imageLoad(numbers, at) * float(FACTOR));
}
