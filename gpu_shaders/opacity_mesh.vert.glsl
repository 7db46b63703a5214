// Opacity maps, vertex stage of meshes: only their depth is kept. What is nearer to the light than
// the hair counts as if it lay where the map begins.
#include "lib_opacity.glsl"

void main()
{
  vec3 place = map_place(opacity, light_index, position);
  float w = dot(opacity.map_w[light_index], vec4(position, 1.0));
  gl_Position = vec4((2.0 * place.xy - 1.0) * w, (2.0 * max(place.z, 0.0) - 1.0) * w, w);
}
