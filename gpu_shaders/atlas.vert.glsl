// Flattened strands in the atlas, vertex stage: ribbons, straight from CV to CV, see
// addon/cards/bake_strands.py. The target holds the samples of one block of the atlas.
#include "lib_strand_texel.glsl"
#include "lib_atlas.glsl"

void main()
{
  int station = gl_VertexID >> 1;
  float side = float(gl_VertexID & 1) * 2.0 - 1.0;
  int strand = first_strand + gl_InstanceID;
  ivec2 texel = strand_texel(strand, station, cv_count);
  vec4 position = texelFetch(cv_places, texel, 0);  // xy place, zw half
  vec4 tangent = texelFetch(cv_tangents, texel, 0);      // xyz tangent, w depth
  vec4 attributes = texelFetch(cv_attributes, texel, 0);    // xyz base, w occlusion
  vec4 strand_values = texelFetch(cv_rest, texel, 0);     // x fraction, y strand_id, z along

  vec2 place = sheared(position.xy + side * position.zw, atlas_size, block_start) / block_samples;
  strand_number = strand;
  strand_id = strand_values.y;
  along_and_side = vec2(strand_values.z, side);
  depth_and_fraction = vec2(tangent.w, strand_values.x);
  strand_tangent = tangent.xyz;
  base_and_occlusion = attributes;
  gl_Position = vec4(2.0 * place - 1.0, 1.0 - 2.0 * tangent.w, 1.0);
}
