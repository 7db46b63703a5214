// Depths of meshes in a light's shadow map, vertex stage. Depth is linear in space, unlike the depth of a
// projected position, so the fragment stage writes it.

void main()
{
  vec4 at = vec4(position, 1.0);
  mesh_depth = dot(map_depth, at);
#ifdef PICTURES
  mesh_uv = picture_place;
#endif
  // z in the middle of the clip range, so that meshes before and behind the map's range are drawn as well
  gl_Position = vec4(dot(map_x, at), dot(map_y, at), 0.0, dot(map_w, at));
}
