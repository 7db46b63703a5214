// Composites a picture over a background colour; both premultiplied by alpha.

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(picture)))) {
    return;
  }
  vec4 over = imageLoad(picture, pixel);
  imageStore(picture, pixel, over + (1.0 - over.a) * background);
}
