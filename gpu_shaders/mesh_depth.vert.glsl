// Depths of meshes in a light's shadow map, vertex stage. Depth is linear in space, unlike the depth of a
// projected position, so the fragment stage writes it.

void main()
{
  vec4 world = vec4(position, 1.0);
  mesh_depth = dot(map_depth, world);
#ifdef PICTURES
  mesh_uv = picture_uv;
#endif
  // z in the middle of the clip range, so that meshes before and behind the map's range are drawn as well
  gl_Position = vec4(dot(map_x, world), dot(map_y, world), 0.0, dot(map_w, world));
}
