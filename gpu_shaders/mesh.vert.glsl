// Meshes, vertex stage: world-space positions and normals.

void main()
{
  mesh_point = position;
  mesh_normal = normal;
  mesh_occlusion = occlusion;
  gl_Position = view.view_projection * vec4(position, 1.0);
}
