// Opacity maps, depths of the first and the last strand, fragment stage: writes nothing but depth.
void main() {}
