// Whether a dispatch writes what it should: each texel its number.
void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  imageStore(probed, at, vec4(float(at.x + at.y * imageSize(probed).x)));
}
