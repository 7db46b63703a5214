// The weight of mesh shadows at places of a map.
#include "lib_opacity.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (at.x < textureSize(places, 0).x) {
    imageStore(result, at, vec4(mesh_shadow_weight(texelFetch(places, at, 0).xy)));
  }
}
