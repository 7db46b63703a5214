// Hashed strands, third step: draws both turns into the target, depth-tested. First the nearer one, blended
// with alpha 0.5; then (are_both), where the farther one passes the test as well, the mean of both, opaque.
void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy) - ivec2(left, bottom);
  vec4 first = texelFetch(first_light, pixel, 0), second = texelFetch(second_light, pixel, 0);
  vec4 near = first.w <= second.w ? first : second;
  float depth = are_both != 0 ? max(first.w, second.w) : near.w;
  if (depth > 1.0) {
    discard;
  }
  color = are_both != 0 ? vec4(0.5 * (first.xyz + second.xyz), 1.0) : 0.5 * vec4(near.xyz, 1.0);
  gl_FragDepth = depth;
}
