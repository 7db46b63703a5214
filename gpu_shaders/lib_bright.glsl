// Luminance of scene-linear Rec. 709; twin of addon/shading/luminance.py.

float luminance_of(vec3 color)
{
  return dot(color, vec3(0.2126, 0.7152, 0.0722));
}
