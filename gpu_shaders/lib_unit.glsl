// Unit vectors.
//
// Twin of unit_or in addon/strands/vectors.py. Holds no resources.

vec3 unit_or(vec3 vector, vec3 fallback)
{
  float size = length(vector);
  return size > 1.0e-6 ? vector / size : fallback;
}

// The world axis along which a vector has its smallest component.
vec3 axis_across(vec3 vector)
{
  vec3 size = abs(vector);
  return size.x <= size.y && size.x <= size.z ? vec3(1.0, 0.0, 0.0) :
         size.y <= size.z                     ? vec3(0.0, 1.0, 0.0) :
                                                vec3(0.0, 0.0, 1.0);
}
