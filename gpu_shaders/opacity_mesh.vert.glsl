// Opacity maps, vertex stage of meshes: only their depth is kept. What is nearer to the light than
// the hair counts as if it lay where the map begins.
#include "lib_opacity.glsl"

void main()
{
  vec4 at = vec4(position, 1.0);
  float w = dot(opacity.map_w[light_index], at);
  float depth = max(dot(opacity.map_depth[light_index], at), 0.0);
  gl_Position = vec4(dot(opacity.map_x[light_index], at), dot(opacity.map_y[light_index], at),
                     (2.0 * depth - 1.0) * w, w);
}
