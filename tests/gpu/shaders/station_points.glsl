// Row: a strand. Column: one of its stations, found and evaluated as in strand.vert.glsl. w: the
// pieces of its segment, 0 beyond the tip.
#include "lib_strand_geometry.glsl"
#include "lib_detail_packing.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  int cv_count = textureSize(cv_points, 0).x;
  int texels = factor_texels(cv_count);
  int last = cv_count - 1;
  int tip = int(texelFetch(totals, ivec2(0, at.y), 0).x);
  StationSearch search = start_search(at.x, tip);
  for (int texel = 0; texel < texels; texel++) {
    search_factors(search, texelFetch(factors, ivec2(texel, at.y), 0));
  }
  vec3 from = texelFetch(cv_points, ivec2(search.found, at.y), 0).xyz;
  vec3 to = texelFetch(cv_points, ivec2(search.found + 1, at.y), 0).xyz;
  vec3 before = texelFetch(cv_points, ivec2(max(search.found - 1, 0), at.y), 0).xyz;
  vec3 after = texelFetch(cv_points, ivec2(min(search.found + 2, last), at.y), 0).xyz;
  before = search.found == 0 ? 2.0 * from - to : before;
  after = search.found == last - 1 ? 2.0 * to - from : after;
  vec3 point = catmull_rom_point(before, from, to, after, found_u(search));
  imageStore(result, at, vec4(point, at.x <= tip ? float(search.pieces) : 0.0));
}
