// A background put under a picture that was drawn over nothing; both premultiplied by alpha.

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(picture)))) {
    return;
  }
  vec4 over = imageLoad(picture, pixel);
  imageStore(picture, pixel, over + (1.0 - over.a) * background);
}
