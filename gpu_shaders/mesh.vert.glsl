// Meshes, vertex stage: world-space positions and normals.

void main()
{
  mesh_point = position;
  mesh_normal = normal;
  mesh_occlusion = occlusion;
#ifdef PICTURES
  mesh_uv = picture_uv;
#endif
#ifdef SKIN_SHADOW
  mesh_skin = skin_place;
#endif
  gl_Position = view.view_projection * vec4(position, 1.0);
}
