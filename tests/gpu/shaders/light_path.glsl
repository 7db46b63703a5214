// light_path of light 0 at points.
#include "lib_opacity_look_up.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (at.x >= textureSize(points, 0).x) {
    return;
  }
  imageStore(result, at, vec4(light_path(0, texelFetch(points, at, 0).xyz), 0.0));
}
