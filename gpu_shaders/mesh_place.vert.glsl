// Places of meshes, vertex stage: world-space positions. CARRIED: other vertex attributes instead.

void main()
{
#ifdef CARRIED
  mesh_point = carried;
#else
  mesh_point = position;
#endif
#ifdef PICTURES
  mesh_uv = picture_place;
#endif
  gl_Position = view.view_projection * vec4(position, 1.0);
}
