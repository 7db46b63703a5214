// Downsampling by a whole factor: each pixel is the mean of its samples.
// Colours are premultiplied by alpha, so that the mean is right at edges as well.

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(picture)))) {
    return;
  }
  vec4 total = vec4(0.0);
  for (int y = 0; y < samples_across; y++) {
    for (int x = 0; x < samples_across; x++) {
      total += texelFetch(samples_of, pixel * samples_across + ivec2(x, y), 0);
    }
  }
  imageStore(picture, pixel, total / float(samples_across * samples_across));
}
