// Cuts holes out of a picture, premultiplied by alpha, by the alpha of another one.

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(picture)))) {
    return;
  }
  float left_over = 1.0 - texelFetch(holes, pixel, 0).a;
  imageStore(picture, pixel, left_over * imageLoad(picture, pixel));
}
