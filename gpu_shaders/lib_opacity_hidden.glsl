// Hair that a mesh hides from a light, and that opacity maps therefore leave out: it gets no light and blocks
// none. So the deep layers of the hair before a head end at the last hair before it, not at that behind it.
//
// Reads the block `opacity`, the integer `light_index` and the texture array `opacity_meshes`.
#include "lib_opacity.glsl"

// Whether the first mesh hides a place of the map and its surroundings, up to `around`, from the light.
bool is_hidden(vec3 place, float around)
{
  int side = textureSize(opacity_meshes, 0).x, map = int(opacity.light[light_index].x);
  float depth = depth_before_meshes(opacity, place.z);
  for (int corner = 0; corner < 4; corner++) {
    vec2 aside = around * (2.0 * vec2(corner & 1, corner >> 1) - 1.0);
    ivec2 texel = clamp(ivec2((place.xy + aside) * float(side)), ivec2(0), ivec2(side - 1));
    if (depth <= texelFetch(opacity_meshes, ivec3(texel, map), 0).x) {
      return false;
    }
  }
  return true;
}

// The same, for a place and the texels around it that a look-up blends.
bool is_hidden_from_texels(vec3 place)
{
  return is_hidden(place, 1.5 / float(opacity.resolution));
}
