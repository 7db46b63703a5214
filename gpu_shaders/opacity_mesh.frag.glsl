// Opacity maps, fragment stage of meshes: depth alone.

void main() {}
