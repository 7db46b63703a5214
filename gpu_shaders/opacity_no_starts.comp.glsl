// Deep opacity maps: clears the first and the last depth in all texels of one light's map to values beyond
// all depths. The maps of other lights stay.

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (texel.x < 2 * side && texel.y < side) {
    imageStore(starts, texel + ivec2(0, side * map_index), uvec4(0xFFFFFFFFu));
  }
}
