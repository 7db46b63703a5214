// Curls that are stretched or compressed with their guide.
//
// Twin of seen and drawn_out in addon/refine/curls.py. Holds no resources.

// The visible part of an extension: solver errors are hidden.
float seen_extension(float extension)
{
  float size = abs(extension);
  return sign(extension) * clamp((size - {{curl_slack}}) * {{curl_catching_up}}, 0.0, size);
}

// The change of a segment by stretching, which keeps its length. axis: xyz direction of the guide, of any
// length, w its extension.
vec3 drawn_out(vec3 segment, vec4 axis)
{
  float size = length(axis.xyz);
  float squared = dot(segment, segment);
  vec3 direction = axis.xyz / max(size, {{curl_shortest}});
  float along = dot(direction, segment);
  vec3 across = segment - direction * along;
  float thick = dot(across, across);
  if (axis.w == 0.0 || size <= {{curl_shortest}} || thick == 0.0) {
    return vec3(0.0);
  }
  // the squared part across shrinks by as much as the squared part along grows
  float left = thick - along * along * axis.w * (2.0 + axis.w);
  left = min(max(left, 0.0), min({{curl_widest}} * {{curl_widest}} * thick, squared));
  float wanted = (along < 0.0 ? -1.0 : 1.0) * sqrt(squared - left);
  return direction * (wanted - along) + across * (sqrt(left / thick) - 1.0);
}
