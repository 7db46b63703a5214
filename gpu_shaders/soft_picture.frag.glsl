// Resolves accumulated samples for a view: the mean light of hair, encoded for the view, over the black of
// its mean shadow on meshes; and the depth of hair.
#include "lib_output.glsl"

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 hair = texelFetch(hair_sum, pixel, 0) / float(sample_count);
  vec2 blocked_and_all = texelFetch(shadow_sum, pixel, 0).xy;
  vec3 light = hair.a > 0.0 ? hair.rgb / hair.a : vec3(0.0);
  float shadow = blocked_and_all.y > 0.0 ? blocked_and_all.x / blocked_and_all.y : 0.0;
  color.rgb = hair.a * output_encoded(light, {{output_viewport}});
  color.a = hair.a + (1.0 - hair.a) * shadow;
  gl_FragDepth = texelFetch(hair_depth, pixel, 0).x;
}
