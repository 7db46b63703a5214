// Hair's shadow on meshes that Blender has drawn, vertex stage: the same mesh, moved a little towards the
// eye, since Blender's own transform rounds differently.
const float NEARER = 5.0e-4;

void main()
{
  mesh_point = position;
  mesh_normal = normal;
  vec3 to_eye = view.eye.xyz - view.eye.w * position;
  gl_Position = view.view_projection * vec4(position + NEARER * to_eye, 1.0);
}
