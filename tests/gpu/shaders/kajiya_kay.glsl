// Evaluates lib_kajiya_kay.glsl for rows of inputs, one texel per input.
#include "lib_kajiya_kay.glsl"

void main()
{
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(result)))) {
    return;
  }
  vec3 tangent = texelFetch(tangents, at, 0).xyz;
  vec3 normal = strand_normal(texelFetch(points, at, 0).xyz, tangent, vec3(0.1, -0.2, 0.3));
  vec4 eye_and_sparkle = texelFetch(eyes, at, 0);
  vec4 light_and_shift = texelFetch(lights, at, 0);
  vec3 sum = kajiya_kay(tangent,
                        normal,
                        light_and_shift.xyz,
                        eye_and_sparkle.xyz,
                        light_and_shift.w,
                        eye_and_sparkle.w,
                        shading);
  imageStore(result, at, vec4(sum, strand_base(0.0, light_and_shift.w, 1.0, shading, shading.base_color).x));
}
