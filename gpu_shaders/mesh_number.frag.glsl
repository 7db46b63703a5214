// Meshes, fragment stage: a number of the object, for masks.

void main()
{
  color = vec4(mesh_number, 0.0, 0.0, 1.0);
}
