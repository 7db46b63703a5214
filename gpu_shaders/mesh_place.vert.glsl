// Where meshes are, vertex stage: world-space positions.

void main()
{
  mesh_point = position;
#ifdef PICTURES
  mesh_uv = picture_place;
#endif
  gl_Position = view.view_projection * vec4(position, 1.0);
}
