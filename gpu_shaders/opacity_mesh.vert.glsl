// Opacity maps, vertex stage of meshes. A light's depths are even in space but not in its picture, as a
// position's would be: they are written one by one.
#include "lib_opacity.glsl"

void main()
{
  vec4 at = vec4(position, 1.0);
  mesh_depth = dot(opacity.map_depth[light_index], at);
  // in the middle of what is drawn, so that meshes before and behind the hair are drawn as well
  gl_Position = vec4(dot(opacity.map_x[light_index], at),
                     dot(opacity.map_y[light_index], at),
                     0.0,
                     dot(opacity.map_w[light_index], at));
}
