// Adds the optical depth of one groom's hair between the first lights and each place in a texture to that of
// other grooms; a channel per light. Places have a number in w: those with the groom's own number already get
// its shadow from its maps, and negative numbers mark texels without a place.
#include "lib_opacity_look_up.glsl"

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, imageSize(other_tau)))) {
    return;
  }
  vec4 place = texelFetch(places, texel, 0);
  if (place.w == float(own_number) || place.w < 0.0) {
    return;
  }
  vec4 tau = imageLoad(other_tau, texel);
  for (int light = 0; light < light_count; light++) {
    if (opacity.light[light].x >= 0.0) {
      tau[light] += opacity.extinction * light_path(light, place.xyz).x;
    }
  }
  imageStore(other_tau, texel, tau);
}
