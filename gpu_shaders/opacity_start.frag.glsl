// Opacity maps, fragment stage of the depths of the first and the last strand: nothing but these.
void main() {}
