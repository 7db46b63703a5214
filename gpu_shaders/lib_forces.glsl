// Forces that act on hair before its constraints.
//
// Twin of addon/dynamics/forces.py, over the globals of lib_guide.glsl. Holds no
// resources.
#include "lib_guide.glsl"

// Quadratic drag, implicit: the previous position that gives a CV the slowed speed.
vec3 apply_drag(vec3 here, vec3 before, float drag, vec3 air_displacement)
{
  vec3 displacement = here - before - air_displacement;
  displacement /= length(displacement) * drag + 1.0;
  return here - (displacement + air_displacement);
}

// The part of gravity that the tension of the carried segments cannot balance, for each free CV.
// Where curls stretch, `load` is set to the tension. carried: positions of the free CVs as carried;
// root: position of the last pinned CV.
void weight_across_style(vec3 gravity, vec3 root, vec3 carried[FREE_SIZE], out vec3 weight[FREE_SIZE])
{
  vec3 segment[FREE_SIZE];
  float ratio[FREE_SIZE];  // elimination factor of segment i - 1 in row i
  float tension[FREE_SIZE];
  vec3 before = root;
  vec3 segment_before = vec3(0.0);
  float inverse_pivot = 0.0;
  float tension_before = 0.0;
  for (int i = 0; i < FREE_COUNT; i++) {
    segment[i] = carried[i] - before;
    before = carried[i];
    float square = dot(segment[i], segment[i]) + TINY * TINY;
    float off_diagonal = -dot(segment[i], segment_before);
    ratio[i] = off_diagonal * inverse_pivot;
    inverse_pivot = 1.0 / ((i == 0 ? square : 2.0 * square) - ratio[i] * off_diagonal);
    float sum = (i == 0 ? dot(segment[i], gravity) : 0.0) - ratio[i] * tension_before;
    tension_before = sum;
    tension[i] = sum * inverse_pivot;
    segment_before = segment[i];
  }
  vec3 above = vec3(0.0);
  float substituted = 0.0;  // part of the tension, by back substitution from the segment above
  for (int i = FREE_COUNT - 1; i >= 0; i--) {
    float solved_tension = tension[i] - substituted;
    substituted = ratio[i] * solved_tension;
#ifdef HAS_SPRINGS
    load[i] = solved_tension * length_of(segment[i]);
#endif
    vec3 pull = segment[i] * solved_tension;
    weight[i] = gravity - (pull - above);
    above = pull;
  }
}
