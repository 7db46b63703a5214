// xyz: the soft shadow at places (xy) of islands (z); w: the known fraction of it.
#include "lib_skin.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (at.x >= textureSize(places, 0).x) {
    return;
  }
  vec3 place = texelFetch(places, at, 0).xyz;
  float known;
  vec4 found = skin_soft_shadow(skin_shadow,
                                skin_texels,
                                skin_stretches,
                                skin_seams,
                                skin_shifts,
                                place.xy,
                                place.z,
                                known);
  imageStore(result, at, vec4(found.xyz, known));
}
