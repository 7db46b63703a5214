// Springs along curled guides.
//
// Twin of addon/dynamics/springs.py, over the globals of lib_guide.glsl and lib_lengths.glsl.
// Holds no resources.
#include "lib_lengths.glsl"

#define STEEPEST {{steepest_spring}}

// One implicit step of the springs. The resulting lengths are the segments' lengths for the rest of the
// substep. `softness` is 1 / (kappa dt^2).
void give(float softness)
{
  for (int i = 0; i < FREE; i++) {
    float steepest = STEEPEST * most[i];
    float extended = length_of(previous[i + 2] - previous[i + 1]) - rest_length[i];
    extended = clamp(extended, -steepest, steepest);
    float used = extended / max(most[i], TINY);
    used *= used;
    float softer = most[i] > 0.0 ? (1.0 - used) * (1.0 - used) / (1.0 + used) : 0.0;
    segment_length[i] = rest_length[i] + extended - softer * (extended / (1.0 - used) + load[i]);
    compliance[i] = softer * softness;
  }
  newton_step(false);
  for (int i = 0; i < FREE; i++) {
    float longest = rest_length[i] + most[i];
    float shortest = rest_length[i] * (rest_length[i] / max(longest, TINY));
    float left = length_of(position[i + 2] - position[i + 1]);
    segment_length[i] = min(max(left, shortest), longest);
    compliance[i] = 0.0;
  }
}
