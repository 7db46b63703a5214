// Rows: radiance_from, diffuse_light, octant_light of the column's corner, and path_from_openness of the
// query's openness.
#include "lib_environment.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  vec3 towards = texelFetch(directions, ivec2(at.x, 0), 0).xyz;
  vec3 found = at.y == 0 ? radiance_from(lights, towards, vec2(0.9, 0.7)) :
               at.y == 1 ? diffuse_light(lights, towards) :
               at.y == 2 ? octant_light(lights, at.x % 8) :
                           vec3(path_from_openness(texelFetch(open_at, ivec2(at.x, 0), 0), towards), 0.0);
  imageStore(result, at, vec4(found, 0.0));
}
