// Angles from their sine and cosine. GLSL guarantees little precision for asin and atan, and Mesa's
// are off by 2e-5, which is visible in a narrow highlight.
//
// Holds no resources.
#include "lib_pi.glsl"

// An angle from 0 to pi: its sine times a polynomial of its cosine, within 1e-7.
float angle_of(float sine, float cosine)
{
  float x = abs(cosine);
  float sum = -0.0979687049984932 + x * 0.01765366829931736;
  sum = 0.2532384693622589 + x * sum;
  sum = -0.4245661795139313 + x * sum;
  sum = 0.5570220351219177 + x * sum;
  sum = -0.6610894799232483 + x * sum;
  sum = 0.7848962545394897 + x * sum;
  sum = -0.9999822378158569 + x * sum;
  sum = (1.570796251296997 + x * sum) * sine;
  return cosine < 0.0 ? PI - sum : sum;
}
