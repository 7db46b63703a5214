// A sine that is the same on every GPU; GLSL guarantees little precision for sin.
//
// Twin of numpy.sin within 1e-6 for angles up to some thousand turns. Holds no resources.

// Sine of an angle [rad].
float sine(float angle)
{
  float turns = floor(angle * 0.15915494309189535 + 0.5);
  // 2 pi in two parts; the first has few bits, so that its product is exact
  float rest = (angle - turns * 6.28125) - turns * 0.0019353071795864769;
  // by symmetry, to the range from -pi / 2 to pi / 2
  rest = rest > 1.5707963267948966 ? 3.1415926535897932 - rest : rest;
  rest = rest < -1.5707963267948966 ? -3.1415926535897932 - rest : rest;
  float square = rest * rest;
  float sum = 2.7557319e-6 - square * 2.5052108e-8;
  sum = -1.9841270e-4 + square * sum;
  sum = 8.3333333e-3 + square * sum;
  sum = -1.6666667e-1 + square * sum;
  return rest + rest * square * sum;
}
