// Return to the style: global and local shape in one direct solve.
//
// Twin of addon/dynamics/style.py and of banded.PentadiagonalSystem.solve, over the globals of
// lib_guide.glsl. References: Han and Harada 2012; Bishop 1975. Holds no
// resources.
#include "lib_guide.glsl"

// Move the free CVs to the minimum of all style energies.
void restore_style()
{
  vec3 right[FREE_SIZE];
  vec3 segment = position[1] - position[0];
  vec3 tangent = unit_of(segment);
  vec3 beside = style_twist - style[0];
  vec3 normal = unit_of(beside - tangent * dot(beside, tangent));
  for (int i = 0; i < FREE_COUNT; i++) {  // residual of the curvature at CV i + 1
    vec3 next_segment = position[i + 2] - position[i + 1];
    vec3 next_tangent = unit_of(next_segment);
    vec3 carried = cross(tangent, normal) * shape[i].z + normal * shape[i].y + tangent * shape[i].x;
    vec3 second = (style[i + 2] - style[i + 1]) - (style[i + 1] - style[i]);
    vec3 residual = carried * shape[i].w + second * (1.0 - shape[i].w);
    right[i] = (residual - next_segment + segment) * local_stiffness[i];
    vec3 middle = next_tangent + tangent;
    float scale = dot(next_tangent, middle) + 1.0e-6;
    normal -= middle / scale * dot(normal, next_tangent);
    tangent = next_tangent;
    segment = next_segment;
  }
  for (int i = 0; i < FREE_COUNT; i++) {
    vec3 sum = (style[i + 2] - position[i + 2]) * band[i].w + right[i];
    if (i + 1 < FREE_COUNT) {
      sum -= 2.0 * right[i + 1];
    }
    if (i + 2 < FREE_COUNT) {
      sum += right[i + 2];
    }
    if (i >= 1) {
      sum -= right[i - 1] * band[i].x;
    }
    if (i >= 2) {
      sum -= right[i - 2] * band[i].y;
    }
    right[i] = sum;
  }
  for (int i = FREE_COUNT - 1; i >= 0; i--) {
    right[i] *= band[i].z;
    if (i < FREE_COUNT - 1) {
      right[i] -= right[i + 1] * band[i + 1].x;
    }
    if (i < FREE_COUNT - 2) {
      right[i] -= right[i + 2] * band[i + 2].y;
    }
    position[i + 2] += right[i];
  }
}
