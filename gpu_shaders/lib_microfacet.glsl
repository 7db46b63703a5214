// Specular reflection of surfaces. Twin of addon/shading/microfacet.py. Holds no resources.
#include "lib_pi.glsl"

float dielectric_fresnel(float cosine, float specular)
{
  float root = sqrt(min(specular, 0.999));
  float ior = (1.0 + root) / (1.0 - root);
  float refracted = sqrt(ior * ior - 1.0 + cosine * cosine);
  float across = (refracted - cosine) / max(refracted + cosine, 1.0e-6);
  float along = (cosine * refracted - 1.0 + cosine * cosine) / (cosine * refracted + 1.0 - cosine * cosine);
  return 0.5 * across * across * (1.0 + along * along);
}

float smith_height(float cosine, float alpha_squared)
{
  return sqrt(alpha_squared + (1.0 - alpha_squared) * cosine * cosine);
}

float ggx_reflection(vec3 normal, vec3 to_light, vec3 to_eye, float specular, float roughness)
{
  float cos_light = dot(normal, to_light), cos_eye = dot(normal, to_eye);
  vec3 half_sum = to_light + to_eye;
  float length_squared = dot(half_sum, half_sum);
  if (min(cos_light, cos_eye) <= 0.0 || length_squared <= 0.0) {
    return 0.0;
  }
  vec3 half_vector = half_sum * inversesqrt(length_squared);
  float alpha_squared = pow(max(roughness, {{min_roughness}}), 4.0);
  // sine from the cross product: 1 - cosine^2 would be too imprecise for a sharp highlight
  vec3 sine_vector = cross(normal, half_vector);
  float cos_half = dot(normal, half_vector);
  float spread = dot(sine_vector, sine_vector) + alpha_squared * cos_half * cos_half;
  float facets = alpha_squared / (PI * spread * spread);
  float heights = cos_light * smith_height(cos_eye, alpha_squared) +
                  cos_eye * smith_height(cos_light, alpha_squared);
  float visible = 0.5 / heights;
  return facets * visible * dielectric_fresnel(clamp(dot(half_vector, to_eye), 0.0, 1.0), specular);
}

float reflected_fraction(float cos_eye, float specular, float roughness)
{
  vec4 terms = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
  float a = min(terms.x * terms.x, exp2(-9.28 * max(cos_eye, 0.0))) * terms.x + terms.y;
  vec2 scale_and_bias = vec2(-1.04, 1.04) * a + terms.zw;
  return specular <= 0.0 ? 0.0 :
                           clamp(specular * scale_and_bias.x + scale_and_bias.y, 0.0, 1.0);
}
