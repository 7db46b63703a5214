// Substeps of a frame of dynamics: one invocation per guide, which loops over all of them.
//
// Twin of advance in addon/dynamics/step.py. Defines: CV_COUNT; RELAXATION; IS_PAINTED, where guides have
// numbers of their own; HAS_HELD; HAS_SPRINGS; HAS_PUSHES, where hair feels other hair; HAS_AIR;
// HAS_FORCE_FIELDS; CONTACT_SLOTS, 0 where there are no colliders; HAS_ROUNDS and HAS_FIELDS, the kinds of
// colliders; INHERITS_MOTION, where hair inherits some of its head's motion; HAS_SHARP, HAS_TRACING and
// HAS_CLEARANCE, see lib_contacts.glsl.
//
// Loops without a constant count test their condition at the end: drivers on CPUs run the body of a loop
// that tests at the begin once more, masked out.
#include "lib_strand_texel.glsl"
#include "lib_guide.glsl"
#include "lib_forces.glsl"
#ifdef HAS_AIR
#include "lib_wind.glsl"
#endif
#ifdef HAS_FORCE_FIELDS
#include "lib_force_fields.glsl"
#endif
#include "lib_style.glsl"
#include "lib_lengths.glsl"
#ifdef HAS_SPRINGS
#include "lib_springs.glsl"
#endif
#if CONTACT_SLOTS > 0
#include "lib_contacts.glsl"
#endif

#define NO_RADIUS -1.0e30  // for CVs that colliders do not move

vec3 style_before[CV_COUNT];
vec3 style_displacement[CV_COUNT];
vec3 style_curvature[CV_COUNT];
vec3 twist_before;
vec3 twist_displacement;
vec3 twist_curvature;
#ifdef HAS_SPRINGS
bool is_curled = false;
#endif
float velocity_factor;    // of the block, or painted for this guide; so is air_factor
float air_factor;
float style_factor = 1.0;  // on the motion that the moving style gives
float gravity_factor = 1.0;
vec3 force_displacement[FREE_SIZE];  // [m] of each free CV by gravity and other hair in a substep

// A rigid motion, see RigidTransform in addon/dynamics/rigid_path.py.
struct RigidTransform {
  vec4 row[3];  // xyz of the rotation, w a coordinate of the moved origin
  vec4 origin;  // xyz; w another number, see dynamics_pass
};

// A motion in `transforms`, see dynamics_pass. The last row has those that are the same for all substeps.
RigidTransform transform_at(int number, int texel)
{
  RigidTransform transform;
  for (int i = 0; i < 3; i++) {
    transform.row[i] = texelFetch(transforms, ivec2(texel + i, number), 0);
  }
  transform.origin = texelFetch(transforms, ivec2(texel + 3, number), 0);
  return transform;
}

vec3 transformed(RigidTransform transform, vec3 point)
{
  vec3 beside = point - transform.origin.xyz;
  return vec3(dot(transform.row[0].xyz, beside), dot(transform.row[1].xyz, beside), dot(transform.row[2].xyz, beside)) +
         vec3(transform.row[0].w, transform.row[1].w, transform.row[2].w);
}

// [m] motion of the style at each free CV in the substep, beyond the inherited motion, where the style moves
// along an arc; else zero
vec3 arc_displacement[FREE_SIZE];
float arc_factor;  // fraction of its motion that the style gives, 0 where there is no arc
#ifdef INHERITS_MOTION
RigidTransform inherited_motion;           // in this substep
RigidTransform previous_inherited_motion;  // in the one before
#endif

// Position and previous position of a CV after it has inherited its head's motion, before anything else acts
// on it.
vec3 with_inherited_motion(vec3 here)
{
#ifdef INHERITS_MOTION
  here = transformed(inherited_motion, here);
#endif
  return here;
}

vec3 previous_with_inherited_motion(vec3 before)
{
#ifdef INHERITS_MOTION
  before = transformed(inherited_motion, transformed(previous_inherited_motion, before));
#endif
  return before;
}

// Curvature of a point's path, times r (r + 1); twin of curvature in addon/dynamics/trajectory.py.
vec3 curvature_of(vec3 earlier, vec3 before, vec3 displacement)
{
  return earlier - before + displacement * frame.gravity.w;
}

void load_guide(int guide)
{
  velocity_factor = frame.velocity_factor;
  air_factor = frame.air_factor;
#ifdef IS_PAINTED
  vec4 painted = texelFetch(painted_numbers, strand_texel(guide, 0, CV_COUNT), 0);
  velocity_factor = painted.x;
  air_factor = painted.y;
  style_factor = painted.z;
  gravity_factor = painted.w;
#endif
  RigidTransform back_from_now = transform_at(frame.substep_count, 8);
  arc_factor = back_from_now.origin.w;
  RigidTransform back_from_earlier = transform_at(frame.substep_count, 12);
  for (int cv = 0; cv < CV_COUNT; cv++) {
    ivec2 texel = strand_texel(guide, cv, CV_COUNT);
    vec4 here = imageLoad(positions, texel);
    position[cv] = here.xyz;
    previous[cv] = vec3(imageLoad(previous_positions, texel).xy, here.w);
    if (frame.speed_ratio != 1.0) {
      previous[cv] = position[cv] - (position[cv] - previous[cv]) * frame.speed_ratio;
    }
    style_before[cv] = texelFetch(styles_before, texel, 0).xyz;
    vec3 now = texelFetch(styles_now, texel, 0).xyz;
    vec3 earlier = texelFetch(styles_earlier, texel, 0).xyz;
    now = transformed(back_from_now, now);
    earlier = transformed(back_from_earlier, earlier);
    style_displacement[cv] = now - style_before[cv];
    style_curvature[cv] = curvature_of(earlier, style_before[cv], style_displacement[cv]);
  }
  for (int i = 0; i < FREE_COUNT; i++) {
    ivec2 texel = strand_texel(guide, i + 1, CV_COUNT);
    shape[i] = texelFetch(rest_shapes, texel, 0);
    segment_length[i] = texelFetch(rest_lengths, texel, 0).x;
#ifdef HAS_SPRINGS
    rest_length[i] = segment_length[i];
    max_extension[i] = texelFetch(curl_slacks, texel, 0).x * rest_length[i] * frame.springs.x;
    compliance[i] = 0.0;
    is_curled = is_curled || max_extension[i] > 0.0;
#endif
#ifdef IS_PAINTED
    band[i] = texelFetch(painted_bands, strand_texel(guide, i + 2, CV_COUNT), 0);
    local_stiffness[i] = texelFetch(painted_numbers, texel, 0).x;
#else
    band[i] = frame.band[i + 2];
    local_stiffness[i] = frame.stiffness_and_radius[i + 1].x;
#endif
    radius[i] = frame.stiffness_and_radius[i + 2].y;
#ifdef HAS_CLEARANCE
    radius[i] = min(radius[i], texelFetch(clearances, strand_texel(guide, i + 2, CV_COUNT), 0).x);
#endif
#ifdef HAS_HELD
    held[i] = texelFetch(held_cvs, strand_texel(guide, i + 2, CV_COUNT), 0).x > 0.0;
    radius[i] = held[i] ? NO_RADIUS : radius[i];
#endif
  }
  int twist_cv = int(texelFetch(rest_shapes, strand_texel(guide, 0, CV_COUNT), 0).x);
  ivec2 texel = strand_texel(guide, twist_cv, CV_COUNT);
  twist_before = texelFetch(styles_before, texel, 0).xyz;
  vec3 now = texelFetch(styles_now, texel, 0).xyz;
  vec3 earlier = texelFetch(styles_earlier, texel, 0).xyz;
  now = transformed(back_from_now, now);
  earlier = transformed(back_from_earlier, earlier);
  twist_displacement = now - twist_before;
  twist_curvature = curvature_of(earlier, twist_before, twist_displacement);
  RigidTransform begin = transform_at(frame.substep_count, 0);
  float at_curvature = transform_at(frame.substep_count, 4).origin.w;
  for (int cv = 0; cv < CV_COUNT; cv++) {
    style[cv] = transformed(begin, style_before[cv] + style_displacement[cv] * begin.origin.w + style_curvature[cv] * at_curvature);
  }
}

// Position of the style halfway through the frame.
vec3 middle_of_style(int cv)
{
  vec3 middle = style_before[cv] + 0.5 * style_displacement[cv];
  RigidTransform halfway = transform_at(frame.substep_count, 16);
  middle = transformed(halfway, middle + style_curvature[cv] * halfway.origin.w);
  return middle;
}

void find_force_displacement(int guide)
{
  vec3 middle[FREE_SIZE];
  for (int i = 0; i < FREE_COUNT; i++) {
    middle[i] = middle_of_style(i + 2);
  }
  vec3 root = middle_of_style(1);
  weight_across_style(frame.compensated_gravity.xyz * gravity_factor, root, middle, force_displacement);
  for (int i = 0; i < FREE_COUNT; i++) {
    force_displacement[i] = frame.gravity.xyz * gravity_factor - force_displacement[i];
#ifdef HAS_PUSHES
    force_displacement[i] += texelFetch(pushes, strand_texel(guide, i + 2, CV_COUNT), 0).xyz;
#endif
#ifdef HAS_SPRINGS
    load[i] *= frame.springs.y;
#endif
  }
}

// Previous position of a CV that gives it the speed after drag.
vec3 after_drag(vec3 here, vec3 before, vec3 air_displacement)
{
  return frame.drag > 0.0 ? apply_drag(here, before, frame.drag, air_displacement) : before;
}

#ifdef HAS_FORCE_FIELDS
vec3 field_displacement[FREE_SIZE];  // [m] of each free CV by force fields in a substep

void find_field_displacement(vec3 air_displacement)
{
  int i = 0;
  do {
    vec3 here = with_inherited_motion(element_at(position, i + 2));
    vec3 before = after_drag(here, previous_with_inherited_motion(element_at(previous, i + 2)), air_displacement);
    vec3 along = with_inherited_motion(element_at(position, min(i + 3, CV_COUNT - 1))) - with_inherited_motion(element_at(position, i + 1));
    vec3 displacement = displacement_by_fields(here, before, field_direction(along));
    for (int k = 0; k < FREE_COUNT; k++) {
      field_displacement[k] = k == i ? displacement : field_displacement[k];
    }
    i++;
  } while (i < FREE_COUNT);
}
#endif

void predict(vec4 path_weights, vec3 air_displacement)
{
#ifdef HAS_FORCE_FIELDS
  find_field_displacement(air_displacement);
#endif
  for (int i = 0; i < FREE_COUNT; i++) {
    vec3 here = with_inherited_motion(position[i + 2]);
    vec3 before = after_drag(here, previous_with_inherited_motion(previous[i + 2]), air_displacement);
#ifdef HAS_FORCE_FIELDS
    before -= field_displacement[i];
#endif
    vec3 impulse = style_displacement[i + 2] * path_weights.z + style_curvature[i + 2] * path_weights.w + arc_displacement[i];
    impulse = impulse * style_factor + force_displacement[i] + air_displacement * air_factor;
    previous[i + 2] = position[i + 2];
    position[i + 2] = (here - before) * velocity_factor + here + impulse;
  }
}

// Pin held CVs, each no farther from the previous held one than the length of the strand between them.
// Neighbouring held CVs keep exactly that distance.
void pin_held()
{
#ifdef HAS_HELD
  vec3 start = style[1];
  float reach = 0.0;
  for (int i = 0; i < FREE_COUNT; i++) {
    reach += LENGTH_AT_REST[i];
    vec3 displacement = style[i + 2] - start;
    float ratio = reach / max(length(displacement), TINY);
    ratio = i == 0 || held[i - 1] ? ratio : min(ratio, 1.0);
    start = held[i] ? start + displacement * ratio : start;
    position[i + 2] = held[i] ? start : position[i + 2];
    reach = held[i] ? 0.0 : reach;
  }
#endif
}

void pin()
{
  previous[0] = position[0];
  previous[1] = position[1];
  position[0] = style[0];
  position[1] = style[1];
  pin_held();
}

void keep_lengths(bool has_normals)
{
#ifdef RELAXATION
  relax_lengths(frame.relaxations);
  if (frame.long_range == 1) {
    hold_within_reach();
  }
#else
  newton_step(has_normals);
#endif
}

// Alternate contacts and lengths, then solve lengths alone until they are within the tolerance.
void solve_contacts()
{
#if CONTACT_SLOTS > 0
  int passes = frame.contact_passes;  // at least one
#ifdef HAS_SHARP
  passes *= part_fraction < 1.0 ? {{part_pass_factor}} : 1;
#endif
  bool is_off = true;
#elif defined(RELAXATION)
  int passes = 0;
  bool is_off = false;
#else
  int passes = 0;
  bool is_off = is_off_length(frame.length_tolerance, frame.springs.z);
#endif
#ifdef RELAXATION
  int steps = passes;
#else
  int steps = passes + frame.length_iterations;
#endif
#if CONTACT_SLOTS > 0
  int round_number = 0;
  bool needs_round = true;
  do {  // another round where the length solve has pulled the guide into a collider
#endif
  int number = 0;
  if (is_off) {
    do {
#if CONTACT_SLOTS > 0
      if (number < passes) {
        push_out(frame.friction);
      }
      keep_lengths(true);
#else
      keep_lengths(false);
#endif
      number++;
#ifndef RELAXATION
      is_off = is_off_length(frame.length_tolerance, frame.springs.z);
#endif
    } while (number < steps && (number < passes || is_off));
  }
#ifndef RELAXATION
  if (is_off) {
    rebuild();
  }
#endif
#if CONTACT_SLOTS > 0
    needs_round = round_number < {{max_extra_rounds}} && is_too_deep();
    round_number++;
    steps += 1 - passes;
    passes = 1;
    is_off = true;
  } while (needs_round);
#endif
}

#ifdef HAS_SHARP
vec3 part_displacement[CV_COUNT];  // [m] sum of each CV's displacements in parts, without what contacts absorbed

// Go back to the begin of the substep. From here on position - previous is a CV's path in the next part.
void begin_parts()
{
  for (int cv = 0; cv < CV_COUNT; cv++) {
    vec3 path = (position[cv] - previous[cv]) * part_fraction;
    position[cv] = previous[cv];
    previous[cv] -= path;
    part_displacement[cv] = vec3(0.0);
  }
}

void begin_part(bool is_last)
{
  for (int cv = 0; cv < CV_COUNT; cv++) {
    vec3 path = position[cv] - previous[cv];
    previous[cv] = position[cv];
    position[cv] += path;
  }
  if (is_last) {  // carried CVs, without accumulated rounding
    position[0] = style[0];
    position[1] = style[1];
    pin_held();
  }
}

void end_part(bool is_last)
{
  for (int cv = 0; cv < CV_COUNT; cv++) {
    part_displacement[cv] += position[cv] - previous[cv];
    previous[cv] = is_last ? position[cv] - part_displacement[cv] : previous[cv];
  }
}
#endif

// Lengths and contacts of a substep; repeated in parts, from its begin, if the guide meets a fast collider.
void solve_lengths_and_contacts(int number)
{
#ifdef HAS_SHARP
  int part = 0;
  int count = 1;
  part_begin = 0.0;
  part_end = 1.0;
  part_fraction = 1.0;
  do {
    if (count > 1) {
      part_begin = float(part) * part_fraction;
      part_end = float(part + 1) * part_fraction;
      begin_part(part == count - 1);
    }
    keep_lengths(false);
    find_contacts(number);
    if (count == 1 && needs_parts) {
      count = {{part_count}};
      part_fraction = 1.0 / float({{part_count}});
      begin_parts();
    } else {
      solve_contacts();
      absorb();
      part++;
      if (count > 1) {
        end_part(part == count);
      }
    }
  } while (part < count);
#else
  keep_lengths(false);
#if CONTACT_SLOTS > 0
  find_contacts(number);
#endif
  solve_contacts();
#if CONTACT_SLOTS > 0
  absorb();
#endif
#endif
}

void do_substep(int number)
{
  vec4 path_weights = texelFetch(substep_table, ivec2(0, number), 0);
#ifdef HAS_AIR
  vec4 phases[{{wind_modes}} / 4];
  for (int i = 0; i < {{wind_modes}} / 4; i++) {
    phases[i] = texelFetch(substep_table, ivec2(1 + i, number), 0);
  }
  vec3 air_displacement = air_at(position[0], phases) * frame.dt;
#else
  vec3 air_displacement = vec3(0.0);
#endif
#ifdef INHERITS_MOTION
  inherited_motion = transform_at(number, 4);
  previous_inherited_motion = transform_at(number > 0 ? number - 1 : frame.substep_count, 4);
#endif
  RigidTransform root_motion = transform_at(number, 0);
  for (int i = 0; i < FREE_COUNT; i++) {
    arc_displacement[i] = -with_inherited_motion(style[i + 2]);
  }
  for (int cv = 0; cv < CV_COUNT; cv++) {
    style[cv] = style_before[cv] + style_displacement[cv] * path_weights.x + style_curvature[cv] * path_weights.y;
    style[cv] = transformed(root_motion, style[cv]);
  }
  style_twist = twist_before + twist_displacement * path_weights.x + twist_curvature * path_weights.y;
  style_twist = transformed(root_motion, style_twist);
  for (int i = 0; i < FREE_COUNT; i++) {
    arc_displacement[i] = (arc_displacement[i] + style[i + 2]) * arc_factor;
  }
  predict(path_weights, air_displacement);
  pin();
#ifdef HAS_SPRINGS
  if (is_curled) {
    spring_step(frame.springs.y);
  }
#endif
  restore_style();
  pin_held();
  solve_lengths_and_contacts(number);
}

void main()
{
  int guide = int(gl_GlobalInvocationID.x);
  if (guide >= frame.guide_count) {
    return;
  }
  load_guide(guide);
  find_force_displacement(guide);
  int number = 0;
  do {
    do_substep(number);
    number++;
  } while (number < frame.substep_count);
  for (int cv = 0; cv < CV_COUNT; cv++) {
    ivec2 texel = strand_texel(guide, cv, CV_COUNT);
    imageStore(positions, texel, vec4(position[cv], previous[cv].z));
    imageStore(previous_positions, texel, vec4(previous[cv].xy, 0.0, 0.0));
  }
}
