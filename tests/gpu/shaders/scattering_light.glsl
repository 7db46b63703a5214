// The w of inputs: shift noise in tangents, sparkle noise in normals, tau beyond in lights, tau in eyes, depth in
// beneath.
#include "lib_dual.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  vec4 tangent = texelFetch(tangents, at, 0), normal = texelFetch(normals, at, 0);
  vec4 to_light = texelFetch(lights, at, 0), to_eye = texelFetch(eyes, at, 0);
  vec4 below = texelFetch(beneath, at, 0);
  SkinSeen seen = SkinSeen(texelFetch(received, at, 0), below.xyz, below.w);
  vec3 light = scattering_light(longitudinal,
                                azimuthal,
                                paths,
                                forward,
                                backward,
                                tangent.xyz,
                                normal.xyz,
                                to_light.xyz,
                                to_eye.xyz,
                                tangent.w,
                                normal.w,
                                fibre.root.xyz,
                                fibre,
                                shading,
                                0.0,
                                to_eye.w,
                                to_light.w,
                                0.7,
                                vec3(0.6, 0.4, 0.3),
                                seen);
  imageStore(result, at, vec4(light, 0.0));
}
