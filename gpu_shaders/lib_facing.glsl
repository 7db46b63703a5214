// Normals on the visible side of a surface. Holds no resources.

// A mesh's normal on its visible side: flipped where the back is seen. Near the silhouette a smooth normal
// may point away from the eye although its triangle is seen from the front; such a normal is reflected
// towards the eye.
//   own: unit normal of the mesh. bent: the same, or as changed by a normal map.
//   facet: normal of the triangle, to either side, of any length.
vec3 facing_normal(vec3 own, vec3 bent, vec3 facet, vec3 to_eye)
{
  bool is_back = dot(own, facet) * dot(facet, to_eye) < 0.0;
  vec3 normal = is_back ? -bent : bent;
  return dot(normal, to_eye) < 0.0 ? reflect(normal, to_eye) : normal;
}
