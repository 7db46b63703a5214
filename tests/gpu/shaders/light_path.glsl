// What light meets on its way to points, of the light with number 0.
#include "lib_opacity_look_up.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (at.x >= textureSize(points, 0).x) {
    return;
  }
  imageStore(result, at, vec4(light_path(0, texelFetch(points, at, 0).xyz), 0.0));
}
