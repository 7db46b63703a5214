// Places of meshes, vertex stage: world-space positions. VERTEX_VALUES: other vertex attributes instead.

void main()
{
#ifdef VERTEX_VALUES
  mesh_point = vertex_values;
#else
  mesh_point = position;
#endif
#ifdef PICTURES
  mesh_uv = picture_uv;
#endif
  gl_Position = view.view_projection * vec4(position, 1.0);
}
