// x, y: high and low half of a hash; z: a unit number; w: noise.
#include "lib_strand_noise.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  vec4 query = texelFetch(queries, at, 0);  // x seed, y channel, z cells along
  uint hash = hash_integer(uint(query.x) * 4u + uint(query.y));
  imageStore(result,
             at,
             vec4(float(hash >> 16u),
                  float(hash & 0xffffu),
                  hash_unit(uint(query.x), uint(query.z)),
                  strand_noise(uint(query.x), uint(query.y), query.z)));
}
