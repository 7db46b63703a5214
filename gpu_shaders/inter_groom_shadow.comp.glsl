// How much hair of another groom lies between the first lights and each of the places in a texture: added
// to what is in the way already, a channel a light. Places have a number in w: those with the groom's own
// have it in their way anyway, and negative ones are none.
#include "lib_opacity_look_up.glsl"

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, imageSize(between)))) {
    return;
  }
  vec4 place = texelFetch(places, texel, 0);
  if (place.w == float(own_number) || place.w < 0.0) {
    return;
  }
  vec4 tau = imageLoad(between, texel);
  for (int light = 0; light < light_count; light++) {
    if (opacity.light[light].x >= 0.0) {
      tau[light] += opacity.extinction * light_path(light, place.xyz).x;
    }
  }
  imageStore(between, texel, tau);
}
