// Occluders of a light: the fraction of each pixel that is covered by surfaces nearer than the light, or by
// hair too thin to have a depth.
// is_separate: meshes are holes in the picture, so every pixel with a depth counts as covered.
// Colour and depth may have several samples for each pixel of the picture.

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(caster)))) {
    return;
  }
  float total = 0.0;
  for (int y = 0; y < samples_across; y++) {
    for (int x = 0; x < samples_across; x++) {
      ivec2 place = pixel * samples_across + ivec2(x, y);
      float depth = texelFetch(depth_of, place, 0).r;
      bool is_before = depth < shafts.radiance.w || depth >= 1.0;
      float covered = clamp(texelFetch(samples_of, place, 0).a, 0.0, 1.0);
      covered = is_separate != 0 && depth < 1.0 ? 1.0 : covered;
      total += is_before ? covered : 0.0;
    }
  }
  imageStore(caster, pixel, vec4(total / float(samples_across * samples_across)));
}
