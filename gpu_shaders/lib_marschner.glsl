// Marschner's scattering from its look-up tables, and the shading of strands by it.
//
// Twin of addon/shading/marschner/{fibre,tables,look}.py, which explain angles and tables: same names,
// same order. Needs struct_fibre.glsl and the struct ShadingSettings.
// References: Marschner et al. 2003; Nguyen and Donnelly 2005, GPU Gems 2, chapter 23.
// Holds no resources.
#include "lib_angle.glsl"
#include "lib_kajiya_kay.glsl"
#include "lib_tint.glsl"

// MIN_COSINE of addon/shading/marschner/interface.py
const float MIN_COSINE = 1.0e-4;
// _MIN_VARIANCE of addon/shading/marschner/tables.py
const float MIN_VARIANCE = 1.0e-6;
// MIN_COLOR of addon/shading/marschner/pigment.py
const float MIN_COLOR = 1.0e-4;

// theta_i, theta_r and |phi| of unit vectors.
vec3 directions_to_angles(vec3 tangent, vec3 to_light, vec3 to_eye)
{
  float sin_i = dot(tangent, to_light), sin_r = dot(tangent, to_eye);
  vec3 across_light = to_light - tangent * sin_i, across_eye = to_eye - tangent * sin_r;
  float cos_i = length(across_light), cos_r = length(across_eye);
  vec2 turn = vec2(length(cross(across_light, across_eye)), dot(across_light, across_eye));
  float size = length(turn);
  turn = size > 0.0 ? turn / size : vec2(0.0, 1.0);
  return vec3(0.5 * PI - angle_of(cos_i, sin_i),
              0.5 * PI - angle_of(cos_r, sin_r),
              angle_of(turn.x, turn.y));
}

// Texture coordinates that map x in 0..1 to the range between the centres of the end texels.
vec2 table_place(vec2 x, vec2 size)
{
  return ((size - 1.0) * clamp(x, 0.0, 1.0) + 0.5) / size;
}

// Level of the longitudinal table that is blurred over this angle of theta_h.
float table_level(float angle, sampler3D longitudinal)
{
  float step = PI / float(textureSize(longitudinal, 0).x - 1);
  return log2(max(angle / step, 1.0));
}

// Fraction of light that absorption leaves of R, TT, TRT and the rest, a column each. Beyond the minimum of
// the fitted parabola, its minimum is used.
mat4x3 lobe_transmittance(vec4 paths, vec3 absorption)
{
  vec3 path_length = min(absorption, vec3(paths.y / max(paths.z, MIN_VARIANCE)));
  return mat4x3(vec3(1.0),
                exp(-absorption * paths.x),
                exp(-path_length * (paths.y - 0.5 * path_length * paths.z)),
                exp(-absorption * paths.w));
}

// S for angles of directions_to_angles; strengths are of R, TT, TRT and the rest. For the level see
// table_level.
vec3 look_up(sampler3D longitudinal,
             sampler2D azimuthal,
             sampler2D paths,
             vec3 angles,
             vec3 absorption,
             vec4 strengths,
             float level)
{
  vec3 size = vec3(textureSize(longitudinal, 0));
  vec2 place = table_place(angles.xy / PI + 0.5, size.xy);
  vec4 along = textureLod(longitudinal, vec3(place, (level + 0.5) / size.z), 0.0);
  place = table_place(vec2(along.w, angles.z / PI), vec2(textureSize(azimuthal, 0)));
  vec4 clear = textureLod(azimuthal, place, 0.0);
  mat4x3 transmittance = lobe_transmittance(textureLod(paths, place, 0.0), absorption);
  vec4 factors = strengths * along.xyzz * clear;
  float cos_d = max(along.w, MIN_COSINE);
  return transmittance * factors / (cos_d * cos_d);
}

// Absorption that gives a mass of hair this colour. Twin of addon/shading/marschner/pigment.py.
vec3 color_absorption(Fibre fibre, vec3 color)
{
  vec3 root = log(clamp(color, MIN_COLOR, 1.0)) / fibre.root.w;
  return root * root;
}

// Absorption at a place of a strand, per radius; both noises are the strand's, in 0..1. root: absorption
// without a tint.
vec3 strand_absorption(Fibre fibre,
                       float along,
                       float color_noise,
                       float grey_noise,
                       ShadingSettings shading,
                       vec3 root)
{
  vec3 mixed = mix(root, fibre.tip.xyz, tip_fraction(along, shading));
  float amount = 1.0 + shading.color_variation * (1.0 - 2.0 * color_noise);
  vec3 grey = vec3(fibre.tip.w * dot(mixed, vec3(1.0 / 3.0)));
  return amount * (grey_noise < shading.grey_fraction ? grey : mixed);
}

// The colour of a mass of hair with this absorption, for light from strand to strand.
vec3 strand_color(Fibre fibre, vec3 absorption)
{
  return exp(-sqrt(max(absorption, 0.0)) * fibre.root.w);
}

// The fraction of light that strands scatter between them back to the side it comes from.
vec3 scattered_color(Fibre fibre, vec3 absorption)
{
  vec3 color = strand_color(fibre, absorption);
  return color / (1.0 + color);
}

// The fraction of a light without a shadow map that arrives where this fraction of ambient light does.
float lit_fraction(float occlusion)
{
  return min(2.0 * occlusion, 1.0);
}

// The angles at a strand whose tangent is shifted by a noise in 0..1.
vec3 strand_angles(vec3 tangent,
                   vec3 normal,
                   vec3 to_light,
                   vec3 to_eye,
                   float shift_noise,
                   ShadingSettings shading)
{
  float shift = shading.shift_noise * (shift_noise - 0.5);
  return directions_to_angles(shifted_tangent(tangent, normal, shift), to_light, to_eye);
}

#ifdef GPU_FRAGMENT_SHADER
// Level at which a highlight does not flicker: blurred over the change of theta_h in a pixel. With light
// from behind, a bend in the light's plane hardly changes theta_h, and the highlight stays sharp.
float pixel_level(sampler3D longitudinal,
                  vec3 tangent,
                  vec3 normal,
                  vec3 to_light,
                  vec3 to_eye,
                  float shift_noise,
                  ShadingSettings shading)
{
  vec3 angles = strand_angles(tangent, normal, to_light, to_eye, shift_noise, shading);
  float theta_h = 0.5 * (angles.x + angles.y);
  return table_level(max(abs(dFdx(theta_h)), abs(dFdy(theta_h))), longitudinal);
}
#endif

// The fraction of light that no strand blocks: exp(-tau), or, where tau is unknown, which is when it is
// negative, by how much the hair's volume faces the light.
float unscattered_fraction(vec3 normal, vec3 to_light, float tau, ShadingSettings shading)
{
  return tau < 0.0 ? mix(1.0, diffuse_bias(normal, to_light), shading.volume_shadow) : exp(-tau);
}

// S of a single strand, for angles of strand_angles. Sparkle only varies TRT.
vec3 single_scattering(sampler3D longitudinal,
                       sampler2D azimuthal,
                       sampler2D paths,
                       vec3 angles,
                       float sparkle_noise,
                       vec3 absorption,
                       Fibre fibre,
                       ShadingSettings shading,
                       float level)
{
  vec4 strengths = fibre.strengths;
  strengths.z *= mix(1.0, sparkle_noise, shading.sparkle);
  return look_up(longitudinal, azimuthal, paths, angles, absorption, strengths, level);
}

// Light from one light to the eye: times irradiance, and times lit_fraction where tau is
// unknown, it is radiance. Both noises are in 0..1; for the level see look_up.
vec3 marschner_light(sampler3D longitudinal,
                     sampler2D azimuthal,
                     sampler2D paths,
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
                     float tau)
{
  vec3 angles = strand_angles(tangent, normal, to_light, to_eye, shift_noise, shading);
  vec3 scattered = single_scattering(
      longitudinal, azimuthal, paths, angles, sparkle_noise, absorption, fibre, shading, level);
  float bias = diffuse_bias(normal, to_light) * (tau < 0.0 ? 1.0 : exp(-tau));
  return scattered * cos(angles.x) * unscattered_fraction(normal, to_light, tau, shading) +
         scattered_color(fibre, absorption) * (shading.fake_scattering * bias / PI);
}
