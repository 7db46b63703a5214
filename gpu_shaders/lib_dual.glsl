// Dual scattering: light that reaches a strand through the strands before it and back from those behind.
//
// Twin of addon/shading/volume/dual.py, which explains the terms: same names, same order.
// Reference: Zinke, Yuksel, Weber and Keyser 2008.
// Needs struct_fibre.glsl and the struct ShadingSettings. Holds no resources.
//
// Colours are columns: a mat3x4 has the four lobes for each of red, green and blue.
#include "lib_marschner.glsl"
#include "lib_skin_seen.glsl"

const float DUAL_SMALLEST = 1.0e-6;
const float DUAL_MAX = 0.999, DUAL_MAX_SCATTERED = 0.9999;
const float DUAL_MIN_LIGHT = 1.0e-3, DUAL_DIFFUSIVITY = 1.66;

// Fraction of light that a fibre scatters forward, or backward, at cos theta_d, by colour and lobe.
mat3x4 fractions_at(sampler2D fractions, float cos_d, vec3 absorption)
{
  vec2 size = vec2(textureSize(fractions, 0));
  vec3 row = absorption / (absorption + {{midpoint_absorption}});
  return mat3x4(textureLod(fractions, table_place(vec2(cos_d, row.r), size), 0.0),
                textureLod(fractions, table_place(vec2(cos_d, row.g), size), 0.0),
                textureLod(fractions, table_place(vec2(cos_d, row.b), size), 0.0));
}

vec3 sum_of_lobes(mat3x4 lobes)
{
  return vec4(1.0) * lobes;
}

// Fraction of light that a stack of `count` strands returns.
vec3 backscattered(vec3 a_forward, vec3 a_backward, float count)
{
  a_forward = clamp(a_forward, vec3(0.0), max(DUAL_MAX_SCATTERED - a_backward, 0.0));
  vec3 middle = 1.0 + a_backward * a_backward - a_forward * a_forward;
  vec3 root = sqrt(max(middle * middle - 4.0 * a_backward * a_backward, 0.0));
  vec3 deep = 2.0 * a_backward / max(middle + root, DUAL_SMALLEST);
  vec3 layer_transmittance = a_forward / max(1.0 - a_backward * deep, DUAL_SMALLEST);
  vec3 stack_factor = pow(clamp(layer_transmittance, DUAL_SMALLEST, 1.0), vec3(2.0 * count));
  return deep * (1.0 - stack_factor) / max(1.0 - deep * deep * stack_factor, DUAL_SMALLEST);
}

// x width and y shift of theta_h in backscattered light, z width that each forward scattering adds.
vec3 backscatter_shape(vec4 forward, vec4 backward, Fibre fibre)
{
  float a_f = min(dot(forward, vec4(1.0)), DUAL_MAX), a_b = dot(backward, vec4(1.0));
  float forward_sum = max(a_f, DUAL_SMALLEST), back = max(a_b, DUAL_SMALLEST);
  float wide_f = sqrt(dot(forward, fibre.widths * fibre.widths) / forward_sum);
  float wide_b = sqrt(dot(backward, fibre.widths * fibre.widths) / back);
  float shift_f = dot(forward, fibre.shifts) / forward_sum, shift_b = dot(backward, fibre.shifts) / back;
  float remainder = 1.0 - a_f * a_f;
  float shift = shift_b * (1.0 - 2.0 * a_b * a_b / (remainder * remainder)) +
                shift_f * ((2.0 * remainder * remainder + 4.0 * a_f * a_f * a_b * a_b) /
                           (remainder * remainder * remainder));
  float wider = 2.0 * wide_f * wide_f;
  float numerator = a_b * sqrt(wider + wide_b * wide_b) +
                    a_b * a_b * a_b * sqrt(wider + 3.0 * wide_b * wide_b);
  float width = (1.0 + 0.7 * a_f * a_f) * numerator /
                max(a_b + a_b * a_b * a_b * (2.0 * wide_f + 3.0 * wide_b), DUAL_SMALLEST);
  return vec3(width, clamp(shift, -0.25 * PI, 0.25 * PI), wide_f);
}

// N of the lobes for light from the half circle around its direction.
vec4 spread_around(vec4 forward, vec4 backward, float phi)
{
  float cosine = cos(phi);
  return (forward * (1.0 - cosine) + backward * (1.0 + cosine)) / (2.0 * PI);
}

// Half of the unit Gaussian of theta_h about -shift: Marschner's M_p.
float half_gaussian(float theta_h, float shift, float variance)
{
  variance = max(variance, DUAL_SMALLEST);
  float offset = theta_h + shift;
  return exp(-0.5 * offset * offset / variance) / (2.0 * sqrt(2.0 * PI * variance));
}

// S of a strand among others. single: S of the strand alone; tau: number of strands between it and the
// light; beyond: number of strands behind it.
vec3 dual_scattering(vec3 single,
                     vec3 angles,
                     mat3x4 forward,
                     mat3x4 backward,
                     float tau,
                     float beyond,
                     Fibre fibre,
                     float density)
{
  float theta_h = 0.5 * (angles.x + angles.y);
  float cos_d = max(cos(0.5 * (angles.y - angles.x)), MIN_COSINE);
  float squared = cos_d * cos_d;
  vec3 a_f = sum_of_lobes(forward), a_b = sum_of_lobes(backward);
  vec3 straight = vec3(exp(-tau));
  vec3 scattered = exp(-tau * (1.0 - a_f)) - straight;
  // widths are the same for all colours: those of green
  vec3 shape = backscatter_shape(forward[1], backward[1], fibre);
  float added = max(tau, 1.0) * shape.z * shape.z;
  // `single` already has what the strand itself returns
  vec3 stack = backscattered(a_f, a_b, 1.0 + beyond) - backscattered(a_f, a_b, 1.0);
  vec3 back = max(stack, 0.0) / (PI * squared);
  vec3 back_straight = back * half_gaussian(theta_h, shape.y, shape.x * shape.x);
  vec3 back_scattered = back * half_gaussian(theta_h, shape.y, shape.x * shape.x + added);
  vec4 along = vec4(half_gaussian(theta_h, fibre.shifts.x, fibre.widths.x * fibre.widths.x + added),
                    half_gaussian(theta_h, fibre.shifts.y, fibre.widths.y * fibre.widths.y + added),
                    half_gaussian(theta_h, fibre.shifts.z, fibre.widths.z * fibre.widths.z + added),
                    half_gaussian(theta_h, fibre.shifts.w, fibre.widths.w * fibre.widths.w + added));
  vec3 forward_part = vec3(dot(along, spread_around(forward[0], backward[0], angles.z)),
                 dot(along, spread_around(forward[1], backward[1], angles.z)),
                 dot(along, spread_around(forward[2], backward[2], angles.z))) / squared;
  return straight * (single + density * back_straight) +
         scattered * density * (forward_part + density * back_scattered);
}

// Light that the skin beneath reflects and a strand scatters to the eye. facing: cosine between the
// light and the skin's normal. skin: its albedo.
vec3 reflected_by_skin(float phi,
                  mat3x4 forward,
                  mat3x4 backward,
                  float tau,
                  float beyond,
                  float facing,
                  vec3 skin)
{
  facing = max(facing, 0.0);
  vec3 a_f = sum_of_lobes(forward), a_b = sum_of_lobes(backward);
  float strands = tau + beyond * (1.0 + DUAL_DIFFUSIVITY * facing);
  vec3 lost = max(1.0 - skin * backscattered(a_f, a_b, beyond), 1.0 - DUAL_MAX);
  vec3 lit = skin * facing / (PI * lost);
  float cosine = cos(phi);
  vec3 onward = 0.5 * (a_f * (1.0 + cosine) + a_b * (1.0 - cosine));
  return lit * exp(-strands * (1.0 - a_f)) * onward;
}

// Light that skin farther away reflects and a strand scatters to the eye. outward: cosine between the
// direction to the eye and the normal of the hair's volume.
vec3 reflected_by_far_skin(
    float outward, mat3x4 forward, mat3x4 backward, vec3 to_light, SkinSeen skin_seen, vec3 skin)
{
  vec3 a_f = sum_of_lobes(forward), a_b = sum_of_lobes(backward);
  vec3 absorbed = sqrt(max((1.0 - a_f) * (1.0 - a_f) - a_b * a_b, 0.0));
  vec3 onward = 0.5 * (a_f * (1.0 + outward) + a_b * (1.0 - outward));
  vec3 lit = 2.0 / PI * skin * far_skin_light(skin_seen.received, to_light);
  return lit * through_hair(skin_seen.depth, absorbed) * onward;
}

// Light that a strand among others scatters to the eye from one light. As marschner_light, but without its
// diffuse term, which stands for light from strand to strand.
vec3 scattering_light(sampler3D longitudinal,
                      sampler2D azimuthal,
                      sampler2D paths,
                      sampler2D fractions_forward,
                      sampler2D fractions_backward,
                      vec3 tangent,
                      vec3 normal,
                      vec3 to_light,
                      vec3 to_eye,
                      float shift_noise,
                      float sparkle_noise,
                      vec3 absorption,
                      Fibre fibre,
                      ShadingSettings shading,
                      float level,
                      float tau,
                      float beyond,
                      float density,
                      vec3 skin,
                      SkinSeen skin_seen)
{
  vec3 angles = strand_angles(tangent, normal, to_light, to_eye, shift_noise, shading);
  vec3 single = single_scattering(
      longitudinal, azimuthal, paths, angles, sparkle_noise, absorption, fibre, shading, level);
  float cos_d = cos(0.5 * (angles.y - angles.x));
  mat3x4 forward = fractions_at(fractions_forward, cos_d, absorption);
  mat3x4 backward = fractions_at(fractions_backward, cos_d, absorption);
  float straight = unscattered_fraction(normal, to_light, tau, shading);
  float passed_tau = tau < 0.0 ? -log(max(straight, DUAL_MIN_LIGHT)) : tau;
  vec3 scattered = dual_scattering(
      single, angles, forward, backward, passed_tau, beyond, fibre, density);
  float facing = dot(skin_seen.beneath, to_light);
  return scattered * cos(angles.x) +
         reflected_by_skin(angles.z, forward, backward, passed_tau, beyond, facing, skin) +
         reflected_by_far_skin(dot(normal, to_eye), forward, backward, to_light, skin_seen, skin);
}
