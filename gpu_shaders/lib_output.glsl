// Encoding of finished colours for the target.

// The sRGB transfer curve (IEC 61966-2-1). Inside the display's range it is all that Blender's view
// transform "Standard" applies.
vec3 srgb_encoded(vec3 radiance)
{
  vec3 curved = 1.055 * pow(max(radiance, vec3(0.0031308)), vec3(1.0 / 2.4)) - 0.055;
  return mix(curved, 12.92 * radiance, lessThanEqual(radiance, vec3(0.0031308)));
}

#ifdef DISPLAY
// Places of radiances along the axes of the display table, in 0 to 1.
// Twin of `shaped` in addon/render/display.py; the shaper is Display.shaper.
vec3 display_shaped(vec3 radiance, vec4 shaper)
{
  return clamp(log2(max(radiance, vec3(0.0)) * shaper.x + 1.0) * shaper.y, 0.0, 1.0);
}

// Code values of Blender's view transform, from the recipe's texture display_table.
// Twin of `Display.display_code`, which applies the gamma too.
vec3 display_code(vec3 radiance, vec4 shaper)
{
  vec3 place = (display_shaped(radiance, shaper) * (shaper.z - 1.0) + 0.5) / shaper.z;
  return texture(display_table, place).xyz;
}
#endif

// The value to write for a scene-linear `radiance`.
// {{output_scene_linear}}: into a picture of our own: the radiance itself.
// {{output_viewport}}: into Blender's viewport from a POST_VIEW handler, which applies no view transform
// and shows a written L as the code value L^(1/2.2): the code value to the power of 2.2. With DISPLAY it is
// the code value of the scene's view transform, else that of "Standard".
vec3 output_encoded(vec3 radiance, int encoding)
{
  if (encoding != {{output_viewport}}) {
    return radiance;
  }
#ifdef DISPLAY
  return pow(display_code(radiance, display_shaper), vec3(2.2 * display_shaper.w));
#else
  return pow(srgb_encoded(clamp(radiance, 0.0, 1.0)), vec3(2.2));
#endif
}
