// Opacity maps, fragment stage of meshes: depth alone. What is nearer to the light than the hair counts
// as if it lay where the map begins.

void main()
{
  gl_FragDepth = clamp(mesh_depth, 0.0, 1.0);
}
