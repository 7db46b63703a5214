// Opacity maps: fills `starts` from two depth buffers, one invocation per texel of `starts`, with the first
// and the last depth of all texels that fall onto it.
void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  int side = imageSize(starts).x / 2, across = textureSize(first_depths, 0).x / side;
  if (at.x >= side || at.y >= side) {
    return;
  }
  float first = 1.0, last = 0.0;
  for (int i = 0; i < across * across; i++) {
    ivec2 texel = at * across + ivec2(i % across, i / across);
    first = min(first, texelFetch(first_depths, texel, 0).x);
    last = max(last, texelFetch(last_depths, texel, 0).x);
  }
  if (last > 0.0) {
    at.y += map_index * side;
    imageStore(starts, at, uvec4(uint(first * {{start_scale}})));
    imageStore(starts, at + ivec2(side, 0), uvec4(uint((1.0 - last) * {{start_scale}})));
  }
}
