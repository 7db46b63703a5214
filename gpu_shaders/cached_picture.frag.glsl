// Shows a kept picture of strands again: their colour, or the depth of hair that hides more than half of
// what lies behind it.

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float front = texelFetch(cached_depth, pixel, 0).x;
  color = texelFetch(cached_color, pixel, 0);
  bool is_empty = writes_depth != 0 ? front >= 1.0 : color.a == 0.0;
  if (is_empty) {
    discard;
  }
  gl_FragDepth = front;
}
