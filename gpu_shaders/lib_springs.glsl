// Springs along curled guides.
//
// Twin of addon/dynamics/springs.py, over the globals of lib_guide.glsl and lib_lengths.glsl.
// Holds no resources.
#include "lib_lengths.glsl"

#define MAX_LINEARISED {{max_linearised}}

// One implicit step of the springs. The resulting lengths are the segments' lengths for the rest of the
// substep. `unit_compliance` is 1 / (kappa dt^2).
void spring_step(float unit_compliance)
{
  for (int i = 0; i < FREE_COUNT; i++) {
    float limit = MAX_LINEARISED * max_extension[i];
    float extension = length_of(previous[i + 2] - previous[i + 1]) - rest_length[i];
    extension = clamp(extension, -limit, limit);
    float squared_ratio = extension / max(max_extension[i], TINY);
    squared_ratio *= squared_ratio;
    float relative_compliance = max_extension[i] > 0.0 ? (1.0 - squared_ratio) * (1.0 - squared_ratio) / (1.0 + squared_ratio) : 0.0;
    segment_length[i] = rest_length[i] + extension - relative_compliance * (extension / (1.0 - squared_ratio) + load[i]);
    compliance[i] = relative_compliance * unit_compliance;
  }
  newton_step(false);
  for (int i = 0; i < FREE_COUNT; i++) {
    float longest = rest_length[i] + max_extension[i];
    float shortest = rest_length[i] * (rest_length[i] / max(longest, TINY));
    float size = length_of(position[i + 2] - position[i + 1]);
    segment_length[i] = min(max(size, shortest), longest);
    compliance[i] = 0.0;
  }
}
