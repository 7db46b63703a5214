// Rows: light_from, matt_light, corner_light of the column's corner, and open_path of the query's openness.
#include "lib_environment.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  vec3 towards = texelFetch(directions, ivec2(at.x, 0), 0).xyz;
  vec3 found = at.y == 0 ? light_from(lights, towards, vec2(0.9, 0.7)) :
               at.y == 1 ? matt_light(lights, towards) :
               at.y == 2 ? corner_light(lights, at.x % 8) :
                           vec3(open_path(texelFetch(open_at, ivec2(at.x, 0), 0), towards), 0.0);
  imageStore(result, at, vec4(found, 0.0));
}
