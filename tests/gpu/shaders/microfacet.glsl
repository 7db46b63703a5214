// x: reflection of one light by a boundary; y: the fraction of all light that it reflects.
#include "lib_microfacet.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  vec4 light = texelFetch(lights, at, 0), eye = texelFetch(eyes, at, 0);
  vec3 normal = texelFetch(normals, at, 0).xyz;
  vec4 value = vec4(0.0);
  value.x = ggx_reflection(normal, light.xyz, eye.xyz, light.w, eye.w);
  value.y = reflected_fraction(dot(normal, eye.xyz), light.w, eye.w);
  imageStore(result, at, value);
}
