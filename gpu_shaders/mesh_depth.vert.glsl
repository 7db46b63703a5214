// Depths of meshes as a light sees them, vertex stage. They are even in space but not in the light's
// picture, as a position's would be: they are written one by one.

void main()
{
  vec4 at = vec4(position, 1.0);
  mesh_depth = dot(map_depth, at);
#ifdef PICTURES
  mesh_uv = picture_place;
#endif
  // in the middle of what is drawn, so that meshes before and behind the map's reach are drawn as well
  gl_Position = vec4(dot(map_x, at), dot(map_y, at), 0.0, dot(map_w, at));
}
