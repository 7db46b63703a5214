// Adds one picture to the sum of the earlier ones, pixel by pixel.

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(sum_of_samples)))) {
    return;
  }
  vec4 found = texelFetch(one_sample, pixel, 0);
  // one NaN or infinity would spoil the pixel for good
  if (any(isnan(found)) || any(isinf(found))) {
    found = vec4(0.0, 0.0, 0.0, found.w == found.w ? clamp(found.w, 0.0, 1.0) : 0.0);
  }
  imageStore(sum_of_samples, pixel, imageLoad(sum_of_samples, pixel) + found);
}
