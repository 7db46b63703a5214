// The mean of all samples so far, premultiplied, scene-linear.

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy) - ivec2(left, bottom);
  color = texelFetch(sum_of_samples, pixel, 0) / float(sample_count);
}
