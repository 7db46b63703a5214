// Curls that are stretched or compressed with their guide.
//
// Twin of visible_extension and change_by_extension in addon/refine/curls.py. Holds no resources.

// The visible part of an extension: solver errors are hidden.
float visible_extension(float extension)
{
  float size = abs(extension);
  return sign(extension) * clamp((size - {{extension_tolerance}}) * {{extension_gain}}, 0.0, size);
}

// The change of a segment by stretching, which keeps its length. axis: xyz direction of the guide, of any
// length, w its extension.
vec3 change_by_extension(vec3 segment, vec4 axis)
{
  float size = length(axis.xyz);
  float squared = dot(segment, segment);
  vec3 direction = axis.xyz / max(size, {{min_axis_length}});
  float along = dot(direction, segment);
  vec3 across = segment - direction * along;
  float across_squared = dot(across, across);
  if (axis.w == 0.0 || size <= {{min_axis_length}} || across_squared == 0.0) {
    return vec3(0.0);
  }
  // the squared part across shrinks by as much as the squared part along grows
  float new_squared = across_squared - along * along * axis.w * (2.0 + axis.w);
  new_squared = min(max(new_squared, 0.0), min({{max_widening}} * {{max_widening}} * across_squared, squared));
  float new_along = (along < 0.0 ? -1.0 : 1.0) * sqrt(squared - new_squared);
  return direction * (new_along - along) + across * (sqrt(new_squared / across_squared) - 1.0);
}
