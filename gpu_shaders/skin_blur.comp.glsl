// Soft shadows on skin, second and third step: a blur along rows (axis 0) or columns (axis 1) of a
// head's UV map, of the same width in metres everywhere, within each island and its gutter.
//
// Twin of blurred in addon/shading/skin/diffusion.py.

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy), size = imageSize(spread);
  if (any(greaterThanEqual(texel, size))) {
    return;
  }
  float island = texelFetch(skin_texels, texel, 0).w;
  vec4 total = vec4(0.0);
  float weight = 0.0;
  if (island >= 0.0) {
    vec2 stretch = texelFetch(skin_stretches, texel, 0).xy;
    float sigma = max(softness / (axis == 0 ? stretch.x : stretch.y), 1e-3);
    int step_of = int(max(ceil({{skin_kernel_reach}} * sigma / float({{skin_kernel_taps}})), 1.0));
    int taps = int({{skin_kernel_reach}} * sigma) / step_of;
    for (int tap = -taps; tap <= taps; tap++) {
      int away = tap * step_of;
      ivec2 at = texel + (axis == 0 ? ivec2(away, 0) : ivec2(0, away));
      bool is_inside = all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, size));
      at = clamp(at, ivec2(0), size - 1);
      if (is_inside && texelFetch(skin_texels, at, 0).w == island) {
        float along = float(away) / sigma;
        float fraction = exp(-0.5 * along * along);
        total += fraction * texelFetch(skin_shadow, at, 0);
        weight += fraction;
      }
    }
  }
  imageStore(spread, texel, weight > 0.0 ? total / weight : vec4(1.0));
}
