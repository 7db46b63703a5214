// Texels of the atlas from their samples: means over the samples that show hair.
//
// Twin of _filtered in addon/cards/bake.py.
#include "lib_atlas.glsl"
#include "lib_unit.glsl"

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, imageSize(texel_place)))) {
    return;
  }
  vec4 place_sum = vec4(0.0), base_sum = vec4(0.0);
  vec3 tangent_sum = vec3(0.0), normal_sum = vec3(0.0);
  float outermost = -1.0, strand_id = 0.0;
  for (int y = 0; y < {{atlas_samples}}; y++) {
    for (int x = 0; x < {{atlas_samples}}; x++) {
      ivec2 from = texel * {{atlas_samples}} + ivec2(x + texel.y, y);  // slanted grid, see Block
      vec4 base = texelFetch(sample_base, from, 0);
      vec4 place = texelFetch(sample_place, from, 0) * base.w;
      vec4 tangent = texelFetch(sample_tangent, from, 0);
      base_sum += base;
      place_sum += place;
      tangent_sum += tangent.xyz * base.w;
      normal_sum += fibre_normal(tangent.xyz, tangent.w) * base.w;
      bool is_outer = base.w > 0.0 && place.z > outermost;
      outermost = is_outer ? place.z : outermost;
      strand_id = is_outer ? place.y : strand_id;
    }
  }
  float covered = base_sum.w;
  float is_hair = covered > 0.0 ? 1.0 : 0.0;
  place_sum /= max(covered, 1.0);
  vec3 tangent = 0.5 * unit_or(tangent_sum, vec3(0.0, 1.0, 0.0)) + 0.5;
  vec3 normal = 0.5 * unit_or(normal_sum, vec3(0.0, 0.0, 1.0)) + 0.5;
  float alpha = covered / float({{atlas_samples}} * {{atlas_samples}});
  imageStore(texel_place, texel, vec4(place_sum.x, strand_id, place_sum.z, place_sum.w));
  imageStore(texel_base, texel, vec4(base_sum.xyz / max(covered, 1.0), alpha));
  imageStore(texel_tangent, texel, vec4(tangent * is_hair, 0.0));
  imageStore(texel_normal, texel, vec4(normal * is_hair, 0.0));
}
