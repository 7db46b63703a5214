// How a finished colour is written to the target.

// The sRGB transfer curve (IEC 61966-2-1), which is all that Blender's view transform "Standard"
// does to colours inside the display's range.
vec3 srgb_encoded(vec3 radiance)
{
  vec3 curved = 1.055 * pow(max(radiance, vec3(0.0031308)), vec3(1.0 / 2.4)) - 0.055;
  return mix(curved, 12.92 * radiance, lessThanEqual(radiance, vec3(0.0031308)));
}

#ifdef DISPLAY
// Where radiances lie along the axes of the display table, in 0 to 1.
// Twin of `shaped` in addon/render/display.py; the shaper is Display.shaper.
vec3 display_shaped(vec3 radiance, vec4 shaper)
{
  return clamp(log2(max(radiance, vec3(0.0)) * shaper.x + 1.0) * shaper.y, 0.0, 1.0);
}

// Code values by Blender's view transform, from the texture display_table of the recipe.
// Twin of `Display.shown`, which does the gamma too.
vec3 display_code(vec3 radiance, vec4 shaper)
{
  vec3 place = (display_shaped(radiance, shaper) * (shaper.z - 1.0) + 0.5) / shaper.z;
  return texture(display_table, place).xyz;
}
#endif

// What to write so that scene-linear `radiance` appears right in the target.
// {{output_scene_linear}}: a picture of our own, scene-linear as it is.
// {{output_viewport}}: Blender's viewport from a POST_VIEW handler, which applies no view transform
// and shows a written L as the code value L^(1/2.2): so the wanted code value to the power of 2.2.
// With DISPLAY the code value is that of the scene's view transform, else that of "Standard".
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
