// Probe of compute shaders: writes its index into each texel.
void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  imageStore(probed, at, vec4(float(at.x + at.y * imageSize(probed).x)));
}
