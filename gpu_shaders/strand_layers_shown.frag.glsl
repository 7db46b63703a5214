// Strands as layers, third step: each pixel's colour into the target, or its depth, where hair hides
// more than half of what lies behind it.

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  color = texelFetch(layer_colors, pixel, 0);
  float front = texelFetch(layer_fronts, pixel, 0).x;
  if (writes_depth != 0 ? front > 1.0 : color.w <= 0.0) {
    discard;
  }
  gl_FragDepth = front;
}
