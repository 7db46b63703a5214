// Soft shadows in the colour of the hair that casts them; places: spread shadow (x) and depth (y).
#include "lib_skin.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (at.x >= textureSize(places, 0).x) {
    return;
  }
  vec2 place = texelFetch(places, at, 0).xy;
  vec3 forward = texelFetch(forwards, at, 0).xyz;
  imageStore(result, at, vec4(skin_colored(place.x, place.y, forward), 0.0));
}
