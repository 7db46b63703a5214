// Soft shadows on skin, last step: the correction at each end of a seam, where more than two sides meet,
// that gives all of them their mean.
//
// Twin of corner_shifts in addon/shading/skin/diffusion.py.
#include "lib_skin.glsl"

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, imageSize(shifts)))) {
    return;
  }
  int end = texel.x % 2, seam = texel.x / 2 + texel.y * {{skin_seams_across}};
  vec4 place = texelFetch(skin_seams, skin_seam_texel(seam, end, 4), 0);
  vec4 islands = texelFetch(skin_seams, skin_seam_texel(seam, 2, 4), 0);
  vec4 copies = texelFetch(skin_seams, skin_seam_texel(seam, 3, 4), 0);
  int first = int(end == 0 ? copies.x : copies.z), count = int(end == 0 ? copies.y : copies.w);
  vec4 shift = vec4(0.0);
  if (count > 2) {
    vec4 total = vec4(0.0);
    float known, sides = 0.0;
    for (int number = first; number < first + count; number++) {
      ivec2 at = ivec2(number % {{skin_copies_across}}, number / {{skin_copies_across}});
      vec4 copy = texelFetch(skin_copies, at, 0);
      vec4 found = skin_looked_up(skin_shadow, skin_texels, copy.xy, copy.z, known);
      total += known > 0.0 ? found : vec4(0.0);
      sides += known > 0.0 ? 1.0 : 0.0;
    }
    vec4 own = skin_looked_up(skin_shadow, skin_texels, place.xy, islands.x, known);
    vec4 other = skin_looked_up(skin_shadow, skin_texels, place.zw, islands.y, known);
    shift = total / max(sides, 1.0) - 0.5 * (own + other);
  }
  imageStore(shifts, texel, shift);
}
