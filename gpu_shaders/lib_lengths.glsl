// Length constraints of segments.
//
// Twin of addon/dynamics/constraints.py and of banded.solve_tridiagonal, over the globals of
// lib_guide.glsl. References: Goldenthal et al. 2007; Jakobsen 2001; Kim, Chentanez and Mueller
// 2012. Holds no resources.
#include "lib_guide.glsl"

#define CONTACT_WEIGHT {{contact_weight}}
#define HELD_WEIGHT {{held_weight}}
#define HELD_SWEEPS {{held_sweeps}}

vec3 touched_normal[FREE_SIZE];  // at each free CV that touches a collider, else zero

// One Newton step on all segments at once. Segment i goes from CV i + 1 to CV i + 2.
void newton_step(bool has_normals)
{
  vec3 segment[FREE_SIZE];
  float ratio[FREE_SIZE];  // elimination factor of segment i - 1 in row i
  float tension[FREE_SIZE];
  vec3 segment_before = vec3(0.0);
  vec3 normal_before = vec3(0.0);
  float inverse_pivot = 0.0;
  float tension_before = 0.0;
  for (int i = 0; i < FREE_COUNT; i++) {
    segment[i] = position[i + 2] - position[i + 1];
    float square = dot(segment[i], segment[i]) + TINY * TINY;
    float diagonal = i == 0 ? square : 2.0 * square;  // the last pinned CV does not move
    float off_diagonal = -dot(segment[i], segment_before);
#ifdef HAS_HELD
    float weight_before = i > 0 && held[i - 1] ? 1.0 - HELD_WEIGHT : 1.0;
    diagonal -= i > 0 ? square * (1.0 - weight_before) : 0.0;
    diagonal -= held[i] ? square * HELD_WEIGHT : 0.0;
    off_diagonal *= weight_before;
#endif
#ifdef HAS_SPRINGS
    diagonal += compliance[i] * square;
#endif
    if (has_normals) {
      float lower = dot(normal_before, segment[i]);
      float upper = dot(touched_normal[i], segment[i]);
      off_diagonal += CONTACT_WEIGHT * (dot(normal_before, segment_before) * lower);
      diagonal -= CONTACT_WEIGHT * (upper * upper);
      diagonal -= CONTACT_WEIGHT * (lower * lower);
      normal_before = touched_normal[i];
    }
    ratio[i] = off_diagonal * inverse_pivot;
    inverse_pivot = 1.0 / (diagonal - ratio[i] * off_diagonal);
    tension_before = square - sqrt(square) * segment_length[i] - ratio[i] * tension_before;
    tension[i] = tension_before * inverse_pivot;
    segment_before = segment[i];
  }
  vec3 above = vec3(0.0);   // the segment above times its tension
  float substituted = 0.0;  // part of the tension, by back substitution from the segment above
  for (int i = FREE_COUNT - 1; i >= 0; i--) {
    float solved_tension = tension[i] - substituted;
    substituted = ratio[i] * solved_tension;
    vec3 pull = segment[i] * solved_tension;
    vec3 move = pull - above;
    above = pull;
    if (has_normals) {
      move -= touched_normal[i] * (CONTACT_WEIGHT * dot(touched_normal[i], move));
    }
#ifdef HAS_HELD
    move = held[i] ? vec3(0.0) : move;
#endif
    position[i + 2] -= move;
  }
}

// Whether any segment's length is off by more than this fraction of it plus `rounding` [m]. Compares
// squares, which needs no root.
bool is_off_length(float tolerance, float rounding)
{
  bool is_off = false;
  for (int i = 0; i < FREE_COUNT; i++) {
    vec3 segment = position[i + 2] - position[i + 1];
    float square = dot(segment, segment) + TINY * TINY;
    float allowed = segment_length[i] * tolerance + rounding;
    float low = max(segment_length[i] - allowed, 0.0);
    float high = segment_length[i] + allowed;
    is_off = is_off || square < low * low || square > high * high;
  }
  return is_off;
}

// Set all segments to their lengths, from the root on, keeping their directions. With held CVs, first from
// these towards the root.
void rebuild()
{
#ifdef HAS_HELD
  vec3 after = position[CV_COUNT - 1];
  bool is_beyond = false;
  for (int i = FREE_COUNT - 1; i > 0; i--) {  // CV i + 1 from the one beyond it
    is_beyond = is_beyond || held[i];
    vec3 place = position[i + 1];
    vec3 moved_place = position[i + 2] - unit_of(after - place) * segment_length[i];
    after = place;
    position[i + 1] = is_beyond && !held[i - 1] ? moved_place : place;
  }
#endif
  vec3 before = position[1];
  vec3 from_root = before;
  for (int i = 0; i < FREE_COUNT; i++) {
    vec3 place = position[i + 2];
    from_root += unit_of(place - before) * segment_length[i];
    before = place;
    position[i + 2] = from_root;
  }
}

void relax_lengths(int sweeps)
{
  for (int sweep = 0; sweep < sweeps; sweep++) {
    for (int i = 0; i < FREE_COUNT; i++) {
      vec3 segment = position[i + 2] - position[i + 1];
      float now = length(segment);
      segment *= (now - segment_length[i]) / max(now, TINY);
      float lower = i == 0 ? 0.0 : 0.5;
      float upper = 1.0 - lower;
#ifdef HAS_HELD
      float free_lower = i == 0 || held[i - 1] ? 0.0 : 1.0;
      float free_upper = held[i] ? 0.0 : 1.0;
      float free = max(free_lower + free_upper, 1.0);
      lower = free_lower / free;
      upper = free_upper / free;
#endif
      position[i + 1] += segment * lower;
      position[i + 2] -= segment * upper;
    }
  }
}

// A point, moved towards another one if it is farther from it than `farthest`.
vec3 within_distance(vec3 point, vec3 other, float farthest)
{
  vec3 offset = point - other;
  return other + offset * min(farthest / max(length(offset), TINY), 1.0);
}

void shorten_segments()
{
  for (int i = 0; i < FREE_COUNT; i++) {
    position[i + 2] = within_distance(position[i + 2], position[i + 1], segment_length[i]);
  }
}

// Limit each CV's distance from the root, in a straight line and along the strand, to its rest length
// along the strand. With held CVs, in sweeps from these to the root and back.
void hold_within_reach()
{
  float reach = 0.0;
  for (int i = 0; i < FREE_COUNT; i++) {
    reach += segment_length[i];
    vec3 offset = position[i + 2] - position[1];
    position[i + 2] = position[1] + offset * min(reach / max(length(offset), TINY), 1.0);
  }
#ifdef HAS_HELD
  vec3 place[FREE_SIZE];
  for (int i = 0; i < FREE_COUNT; i++) {
    place[i] = position[i + 2];
  }
  for (int sweep = 0; sweep < HELD_SWEEPS; sweep++) {
    bool is_beyond = false;
    for (int i = FREE_COUNT - 1; i >= 0; i--) {
      position[i + 2] = held[i] ? place[i] : position[i + 2];
    }
    for (int i = FREE_COUNT - 2; i >= 0; i--) {
      is_beyond = is_beyond || held[i + 1];
      vec3 near = within_distance(position[i + 2], position[i + 3], segment_length[i + 1]);
      position[i + 2] = is_beyond && !held[i] ? near : position[i + 2];
    }
    shorten_segments();
  }
#else
  shorten_segments();
#endif
}
