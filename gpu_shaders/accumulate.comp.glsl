// Adds one picture to the sum of the earlier ones, pixel by pixel.

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(sum_of_samples)))) {
    return;
  }
  vec4 new_sample = texelFetch(one_sample, pixel, 0);
  // one NaN or infinity would spoil the pixel for good
  if (any(isnan(new_sample)) || any(isinf(new_sample))) {
    new_sample = vec4(0.0, 0.0, 0.0, new_sample.w == new_sample.w ? clamp(new_sample.w, 0.0, 1.0) : 0.0);
  }
  imageStore(sum_of_samples, pixel, imageLoad(sum_of_samples, pixel) + new_sample);
}
