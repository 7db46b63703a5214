// Substeps of a frame of dynamics: one invocation per guide, which loops over all of them.
//
// Twin of advance in addon/dynamics/step.py. Defines: CV_COUNT; RELAXATION; IS_PAINTED, where guides have
// numbers of their own; HAS_HELD; HAS_SPRINGS; HAS_PUSHES, where hair feels other hair; HAS_AIR;
// HAS_FORCE_FIELDS; CONTACT_SLOTS, 0 where there are no colliders; HAS_ROUNDS and HAS_FIELDS, the kinds of
// colliders; INHERITS, where hair inherits some of its head's motion; HAS_SHARP, HAS_FOLLOWED and
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
float own_kept;           // of the block, or painted for this guide; so is own_air
float own_air;
float own_carried = 1.0;  // factor on the motion that the moving style gives
float own_gravity = 1.0;
vec3 fall[FREE_SIZE];  // [m] displacement of each free CV by gravity and other hair in a substep

// A rigid motion, see Carry in addon/dynamics/rigid_path.py.
struct Carry {
  vec4 row[3];  // xyz of the rotation, w a coordinate of the moved origin
  vec4 origin;  // xyz; w another number, see dynamics_pass
};

// A motion in `carriers`, see dynamics_pass. The last row has those that are the same for all substeps.
Carry carry_at(int number, int texel)
{
  Carry carry;
  for (int i = 0; i < 3; i++) {
    carry.row[i] = texelFetch(carriers, ivec2(texel + i, number), 0);
  }
  carry.origin = texelFetch(carriers, ivec2(texel + 3, number), 0);
  return carry;
}

vec3 carried(Carry carry, vec3 point)
{
  vec3 beside = point - carry.origin.xyz;
  return vec3(dot(carry.row[0].xyz, beside), dot(carry.row[1].xyz, beside), dot(carry.row[2].xyz, beside)) +
         vec3(carry.row[0].w, carry.row[1].w, carry.row[2].w);
}

// [m] motion of the style at each free CV in the substep, beyond the inherited motion, where the style moves
// along an arc; else zero
vec3 style_moved[FREE_SIZE];
float arc_carried;  // fraction of its motion that the style gives, 0 where there is no arc
#ifdef INHERITS
Carry inherited;         // in this substep
Carry inherited_before;  // in the one before
#endif

// Position and previous position of a CV after it has inherited its head's motion, before anything else acts
// on it.
vec3 inheriting(vec3 here)
{
#ifdef INHERITS
  here = carried(inherited, here);
#endif
  return here;
}

vec3 inheriting_before(vec3 before)
{
#ifdef INHERITS
  before = carried(inherited, carried(inherited_before, before));
#endif
  return before;
}

// Curvature of a point's path, times r (r + 1); twin of curvature in addon/dynamics/trajectory.py.
vec3 curvature_of(vec3 earlier, vec3 before, vec3 displacement)
{
  return earlier - before + displacement * frame.fall.w;
}

void load_guide(int guide)
{
  own_kept = frame.kept;
  own_air = frame.air_fraction;
#ifdef IS_PAINTED
  vec4 own = texelFetch(painted_numbers, strand_texel(guide, 0, CV_COUNT), 0);
  own_kept = own.x;
  own_air = own.y;
  own_carried = own.z;
  own_gravity = own.w;
#endif
  Carry seen_now = carry_at(frame.substep_count, 8);
  arc_carried = seen_now.origin.w;
  Carry seen_earlier = carry_at(frame.substep_count, 12);
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
    now = carried(seen_now, now);
    earlier = carried(seen_earlier, earlier);
    style_displacement[cv] = now - style_before[cv];
    style_curvature[cv] = curvature_of(earlier, style_before[cv], style_displacement[cv]);
  }
  for (int i = 0; i < FREE; i++) {
    ivec2 texel = strand_texel(guide, i + 1, CV_COUNT);
    shape[i] = texelFetch(rest_shapes, texel, 0);
    segment_length[i] = texelFetch(rest_lengths, texel, 0).x;
#ifdef HAS_SPRINGS
    rest_length[i] = segment_length[i];
    most[i] = texelFetch(curl_rooms, texel, 0).x * rest_length[i] * frame.springs.x;
    compliance[i] = 0.0;
    is_curled = is_curled || most[i] > 0.0;
#endif
#ifdef IS_PAINTED
    band[i] = texelFetch(painted_bands, strand_texel(guide, i + 2, CV_COUNT), 0);
    bend[i] = texelFetch(painted_numbers, texel, 0).x;
#else
    band[i] = frame.band[i + 2];
    bend[i] = frame.own[i + 1].x;
#endif
    radius[i] = frame.own[i + 2].y;
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
  now = carried(seen_now, now);
  earlier = carried(seen_earlier, earlier);
  twist_displacement = now - twist_before;
  twist_curvature = curvature_of(earlier, twist_before, twist_displacement);
  Carry begin = carry_at(frame.substep_count, 0);
  float at_curvature = carry_at(frame.substep_count, 4).origin.w;
  for (int cv = 0; cv < CV_COUNT; cv++) {
    style[cv] = carried(begin, style_before[cv] + style_displacement[cv] * begin.origin.w + style_curvature[cv] * at_curvature);
  }
}

// Position of the style halfway through the frame.
vec3 middle_of_style(int cv)
{
  vec3 middle = style_before[cv] + 0.5 * style_displacement[cv];
  Carry halfway = carry_at(frame.substep_count, 16);
  middle = carried(halfway, middle + style_curvature[cv] * halfway.origin.w);
  return middle;
}

void find_fall(int guide)
{
  vec3 middle[FREE_SIZE];
  for (int i = 0; i < FREE; i++) {
    middle[i] = middle_of_style(i + 2);
  }
  vec3 root = middle_of_style(1);
  weight_on_style(frame.combed.xyz * own_gravity, root, middle, fall);
  for (int i = 0; i < FREE; i++) {
    fall[i] = frame.fall.xyz * own_gravity - fall[i];
#ifdef HAS_PUSHES
    fall[i] += texelFetch(pushes, strand_texel(guide, i + 2, CV_COUNT), 0).xyz;
#endif
#ifdef HAS_SPRINGS
    load[i] *= frame.springs.y;
#endif
  }
}

// Previous position of a CV that gives it the speed after drag.
vec3 slowed(vec3 here, vec3 before, vec3 air_displacement)
{
  return frame.drag > 0.0 ? braked(here, before, frame.drag, air_displacement) : before;
}

#ifdef HAS_FORCE_FIELDS
vec3 blown[FREE_SIZE];  // [m] displacement of each free CV by force fields in a substep

void feel_fields(vec3 air_displacement)
{
  int i = 0;
  do {
    vec3 here = inheriting(picked(position, i + 2));
    vec3 before = slowed(here, inheriting_before(picked(previous, i + 2)), air_displacement);
    vec3 along = inheriting(picked(position, min(i + 3, CV_COUNT - 1))) - inheriting(picked(position, i + 1));
    vec3 felt = blown_by_fields(here, before, field_direction(along));
    for (int k = 0; k < FREE; k++) {
      blown[k] = k == i ? felt : blown[k];
    }
    i++;
  } while (i < FREE);
}
#endif

void predict(vec4 moment, vec3 air_displacement)
{
#ifdef HAS_FORCE_FIELDS
  feel_fields(air_displacement);
#endif
  for (int i = 0; i < FREE; i++) {
    vec3 here = inheriting(position[i + 2]);
    vec3 before = slowed(here, inheriting_before(previous[i + 2]), air_displacement);
#ifdef HAS_FORCE_FIELDS
    before -= blown[i];
#endif
    vec3 impulse = style_displacement[i + 2] * moment.z + style_curvature[i + 2] * moment.w + style_moved[i];
    impulse = impulse * own_carried + fall[i] + air_displacement * own_air;
    previous[i + 2] = position[i + 2];
    position[i + 2] = (here - before) * own_kept + here + impulse;
  }
}

// Pin held CVs, each no farther from the previous held one than the length of the strand between them.
// Neighbouring held CVs keep exactly that distance.
void pin_held()
{
#ifdef HAS_HELD
  vec3 start = style[1];
  float reach = 0.0;
  for (int i = 0; i < FREE; i++) {
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
void keep_outside()
{
#if CONTACT_SLOTS > 0
  int passes = frame.contact_passes;  // at least one
#ifdef HAS_SHARP
  passes *= part_fraction < 1.0 ? {{part_passes}} : 1;
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
  bool is_again = true;
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
    lay_out();
  }
#endif
#if CONTACT_SLOTS > 0
    is_again = round_number < {{more_rounds}} && is_deep();
    round_number++;
    steps += 1 - passes;
    passes = 1;
    is_off = true;
  } while (is_again);
#endif
}

#ifdef HAS_SHARP
vec3 went[CV_COUNT];  // [m] sum of each CV's displacements in parts, without what contacts absorbed

// Go back to the begin of the substep. From here on position - previous is a CV's path in the next part.
void begin_parts()
{
  for (int cv = 0; cv < CV_COUNT; cv++) {
    vec3 path = (position[cv] - previous[cv]) * part_fraction;
    position[cv] = previous[cv];
    previous[cv] -= path;
    went[cv] = vec3(0.0);
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
    went[cv] += position[cv] - previous[cv];
    previous[cv] = is_last ? position[cv] - went[cv] : previous[cv];
  }
}
#endif

// Lengths and contacts of a substep; repeated in parts, from its begin, if the guide meets a fast collider.
void go_outside(int number)
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
    if (count == 1 && is_hurried) {
      count = {{parts}};
      part_fraction = 1.0 / float({{parts}});
      begin_parts();
    } else {
      keep_outside();
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
  keep_outside();
#if CONTACT_SLOTS > 0
  absorb();
#endif
#endif
}

void do_substep(int number)
{
  vec4 moment = texelFetch(moments, ivec2(0, number), 0);
#ifdef HAS_AIR
  vec4 turns[{{wind_modes}} / 4];
  for (int i = 0; i < {{wind_modes}} / 4; i++) {
    turns[i] = texelFetch(moments, ivec2(1 + i, number), 0);
  }
  vec3 air_displacement = air_at(position[0], turns) * frame.dt;
#else
  vec3 air_displacement = vec3(0.0);
#endif
#ifdef INHERITS
  inherited = carry_at(number, 4);
  inherited_before = carry_at(number > 0 ? number - 1 : frame.substep_count, 4);
#endif
  Carry place = carry_at(number, 0);
  for (int i = 0; i < FREE; i++) {
    style_moved[i] = -inheriting(style[i + 2]);
  }
  for (int cv = 0; cv < CV_COUNT; cv++) {
    style[cv] = style_before[cv] + style_displacement[cv] * moment.x + style_curvature[cv] * moment.y;
    style[cv] = carried(place, style[cv]);
  }
  style_twist = twist_before + twist_displacement * moment.x + twist_curvature * moment.y;
  style_twist = carried(place, style_twist);
  for (int i = 0; i < FREE; i++) {
    style_moved[i] = (style_moved[i] + style[i + 2]) * arc_carried;
  }
  predict(moment, air_displacement);
  pin();
#ifdef HAS_SPRINGS
  if (is_curled) {
    give(frame.springs.y);
  }
#endif
  restore_style();
  pin_held();
  go_outside(number);
}

void main()
{
  int guide = int(gl_GlobalInvocationID.x);
  if (guide >= frame.guide_count) {
    return;
  }
  load_guide(guide);
  find_fall(guide);
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
