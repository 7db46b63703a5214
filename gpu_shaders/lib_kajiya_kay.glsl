// Kajiya-Kay shading of hair with Scheuermann's two shifted highlights.
//
// Twin of addon/shading/kajiya_kay.py: same names, same order; a test compares the two.
// References: Kajiya and Kay 1989, "Rendering Fur with Three Dimensional Textures"; Scheuermann
// 2004, "Practical Real-Time Hair Rendering and Shading"; for the origin of the two highlights,
// Marschner et al. 2003.
// Needs the struct ShadingSettings, which is made from addon/shading/settings.py.
// Holds no resources.
//
//          N  T'          T  tangent from root to tip, N normal of the hair's volume.
//          | /            T' = T + s N for s > 0. The highlight lies where T' is across the
//          |/             half vector H. There N, which leans more and more to the tip along a strand,
//   root --+----> T tip   has leaned past H: a positive shift moves the highlight towards the tip.
//
// Limits: no shadows except those in the occlusion; no energy conservation.
#include "lib_tint.glsl"
#include "lib_unit.glsl"

// GREY_COLOR of addon/shading/kajiya_kay.py
const vec3 GREY_COLOR = vec3(0.42, 0.42, 0.43);

// Normal of the hair's volume: away from its centre, made perpendicular to the strand; any perpendicular
// where the strand itself points away from the centre.
vec3 strand_normal(vec3 point, vec3 tangent, vec3 center)
{
  vec3 outward = unit_or(point - center, vec3(0.0, 0.0, 1.0));
  vec3 across = outward - tangent * dot(outward, tangent);
  vec3 axis = axis_across(tangent);
  return unit_or(dot(across, across) > 1.0e-6 ? across : cross(tangent, axis), axis);
}

float diffuse_bias(vec3 normal, vec3 to_light)
{
  return max(0.0, 0.75 * dot(normal, to_light) + 0.25);
}

vec3 shifted_tangent(vec3 tangent, vec3 normal, float shift)
{
  return unit_or(tangent + shift * normal, tangent);
}

// sin^p as (1 - cos^2)^(p / 2): a square root would round near the peak, and p would amplify the error.
float strand_specular(vec3 tangent, vec3 half_vector, float exponent)
{
  float along = dot(tangent, half_vector);
  float across_squared = max(0.0, 1.0 - along * along);
  return smoothstep(-1.0, 0.0, along) * pow(across_squared, 0.5 * exponent);
}

// (diffuse + specular) of one light; times irradiance / pi, base colour and occlusion it is radiance.
// Both noises are in 0..1.
vec3 kajiya_kay(vec3 tangent,
                vec3 normal,
                vec3 to_light,
                vec3 to_eye,
                float shift_noise,
                float sparkle_noise,
                ShadingSettings shading)
{
  float diffuse = diffuse_bias(normal, to_light);
  vec3 half_vector = unit_or(to_light + to_eye, normal);
  float shift = shading.shift_noise * (shift_noise - 0.5);
  vec3 primary_tangent = shifted_tangent(tangent, normal, shading.primary_shift + shift);
  vec3 secondary_tangent = shifted_tangent(tangent, normal, shading.secondary_shift + shift);
  vec3 primary = shading.primary_strength * shading.primary_color *
                 strand_specular(primary_tangent, half_vector, shading.primary_exponent);
  vec3 secondary = shading.secondary_strength * shading.secondary_color *
                   strand_specular(secondary_tangent, half_vector, shading.secondary_exponent);
  secondary *= mix(1.0, sparkle_noise, shading.sparkle);
  return diffuse + diffuse * (primary + secondary);
}

// The hair's colour at a place of a strand: a mix of root and tip colour, or grey, made darker or
// brighter by the strand's colour noise in 0..1. Strands whose grey noise is below grey_fraction are grey.
vec3 strand_base(
    float along, float color_noise, float grey_noise, ShadingSettings shading, vec3 root)
{
  vec3 color = mix(root, shading.tip_color, tip_fraction(along, shading));
  color = grey_noise < shading.grey_fraction ? GREY_COLOR : color;
  return color * (1.0 + shading.color_variation * (2.0 * color_noise - 1.0));
}
