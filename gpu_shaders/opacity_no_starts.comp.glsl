// Deep opacity maps before any hair is in them: in all texels of one light the first and the last hair
// lie beyond all depths. The maps of others stay.

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (texel.x < 2 * side && texel.y < side) {
    imageStore(starts, texel + ivec2(0, side * map_index), uvec4(0xFFFFFFFFu));
  }
}
