// Test values at each place for all inputs of the shading of cards, in the dialect of hair_shading.gdshaderinc.
float probe_wave(float at, float number)
{
  return 0.5 + 0.5 * sin(at * (1.0 + 0.37 * number) + number);
}

vec3 probe_vector(float at, float first)
{
  return vec3(probe_wave(at, first), probe_wave(at, first + 1.0), probe_wave(at, first + 2.0));
}

vec3 probe_direction(float at, float first)
{
  return hair_unit(2.0 * probe_vector(at, first) - 1.0, vec3(0.0, 0.0, 1.0));
}

vec4 probe(sampler2D longitudinal, sampler2D azimuthal, sampler2D paths, float at, int model)
{
  HairMaterial hair;
  hair.model = model;
  hair.base_color = probe_vector(at, 1.0);
  hair.tip_color = probe_vector(at, 4.0);
  hair.tip_tint = probe_wave(at, 7.0);
  hair.tint_start = 0.5 * probe_wave(at, 8.0);
  hair.tint_end = 0.5 + 0.5 * probe_wave(at, 9.0);
  hair.grey_fraction = probe_wave(at, 10.0);
  hair.shift_noise = probe_wave(at, 11.0);
  hair.sparkle = probe_wave(at, 12.0);
  hair.ambient = probe_wave(at, 13.0);
  hair.primary_color = probe_vector(at, 14.0);
  hair.primary_strength = probe_wave(at, 17.0);
  hair.primary_exponent = 50.0 * probe_wave(at, 18.0);
  hair.primary_shift = probe_wave(at, 19.0) - 0.5;
  hair.secondary_color = probe_vector(at, 20.0);
  hair.secondary_strength = probe_wave(at, 23.0);
  hair.secondary_exponent = 20.0 * probe_wave(at, 24.0);
  hair.secondary_shift = probe_wave(at, 25.0) - 0.5;
  hair.fibre_root = vec4(probe_vector(at, 26.0), 1.0 + 5.0 * probe_wave(at, 29.0));
  hair.fibre_tip = vec4(probe_vector(at, 30.0), probe_wave(at, 33.0));
  hair.fibre_strengths = vec4(probe_vector(at, 34.0), probe_wave(at, 37.0));
  hair.fake_scattering = probe_wave(at, 38.0);
  hair.volume_shadow = probe_wave(at, 39.0);

  HairPlace here;
  vec3 normal = probe_direction(at, 40.0);
  vec3 tangent = hair_unit(cross(normal, probe_direction(at, 43.0)), normal);
  here.normal = hair_normal(probe_vector(at, 46.0), tangent, normal);
  here.tangent = hair_tangent(probe_vector(at, 49.0), tangent, normal, hair.shift_noise);
  here.to_eye = probe_direction(at, 52.0);
  here.along = probe_wave(at, 55.0);
  here.shift = probe_wave(at, 56.0);
  here.sparkle = probe_wave(at, 57.0);
  here.base = probe_vector(at, 58.0);
  vec3 sent = hair_light(hair, longitudinal, azimuthal, paths, here, probe_direction(at, 61.0));
  float occlusion = probe_wave(at, 68.0);
  sent *= hair_lit_fraction(hair, occlusion);
  sent += hair_ambient(hair, here.along, here.base, occlusion);
  float alpha = hair_view_compensated_alpha(probe_wave(at, 64.0), probe_direction(at, 65.0), tangent,
                                            here.to_eye, vec2(0.8, 0.1));
  return vec4(sent, alpha);
}
