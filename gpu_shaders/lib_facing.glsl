// Which side of a surface is seen. Holds no resources.

// A mesh's normal on the side that is seen: turned over where that is its back. Towards an outline a
// smooth normal leans away from the eye though its triangle is seen from the front; of such a normal
// only what points away is turned.
//   own: unit normal of the mesh. bent: the same, or as a picture bends it.
//   facet: across the triangle, to either side, of any length.
vec3 facing_normal(vec3 own, vec3 bent, vec3 facet, vec3 to_eye)
{
  bool is_back = dot(own, facet) * dot(facet, to_eye) < 0.0;
  vec3 normal = is_back ? -bent : bent;
  return dot(normal, to_eye) < 0.0 ? reflect(normal, to_eye) : normal;
}
