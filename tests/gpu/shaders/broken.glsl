#include "lib_strand_noise.glsl"

void main()
{
  float fine = 1.0;
  float wrong = undeclared_thing;
}
