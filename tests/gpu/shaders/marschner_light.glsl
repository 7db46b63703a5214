// The w of inputs: shift noise in tangents, sparkle noise in normals, level in lights, tau in eyes.
#include "lib_marschner.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  vec4 tangent = texelFetch(tangents, at, 0), normal = texelFetch(normals, at, 0);
  vec4 to_light = texelFetch(lights, at, 0);
  vec4 to_eye = texelFetch(eyes, at, 0);
  vec3 light = marschner_light(longitudinal,
                               azimuthal,
                               paths,
                               tangent.xyz,
                               normal.xyz,
                               to_light.xyz,
                               to_eye.xyz,
                               tangent.w,
                               normal.w,
                               fibre.root.xyz,
                               fibre,
                               shading,
                               to_light.w,
                               to_eye.w);
  imageStore(result, at, vec4(light, 0.0));
}
