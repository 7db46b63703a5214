// Contacts: found once in a substep, solved as planes each time lengths and contacts alternate.
//
// Twin of addon/dynamics/contacts.py, over the globals of lib_guide.glsl; see there. Defines:
// CONTACT_SLOTS, how many contacts a CV may have at once; HAS_SHARP, where segments collide too;
// HAS_FOLLOWED, where paths are followed, that is with HAS_SHARP and where colliders are fast;
// HAS_CLEARANCE, where guides keep no more distance than when the motion began. Needs the block
// `frame`, and `moments`.
#include "lib_lengths.glsl"
#include "lib_collider.glsl"

#define SKIN (frame.reach * {{skin_of_reach}})
#define NO_PLANE -1.0e30
#define BETWEEN_RADIUS {{between_radius}}
#define TRACE_STEPS {{trace_steps}}

// xyz normal outwards, w offset [m]: keep normal . x >= offset
vec4 plane[CONTACT_SLOTS][FREE_SIZE];
// xyz where the CV would be had it moved with the collider [m]; w distance from the plane within which
// it counts as touching [m], NO_PLANE for never
vec4 origin[CONTACT_SLOTS][FREE_SIZE];
float pushed[CONTACT_SLOTS][FREE_SIZE];  // [m] in this substep
#ifdef HAS_SHARP
// the same for a point of each segment; segment i ends at free CV i
vec4 between_plane[CONTACT_SLOTS][FREE_SIZE];
vec4 between_origin[CONTACT_SLOTS][FREE_SIZE];
float between_pushed[CONTACT_SLOTS][FREE_SIZE];
float between_along[CONTACT_SLOTS][FREE_SIZE];  // place of the point on the segment, 0 to 1
vec3 between_normal[FREE_SIZE];  // at each free CV with a touching segment, else zero
// Begin, end and length of a part of the substep, as fractions of the substep; and whether the contacts
// found last require the substep to be done in parts.
float part_begin;
float part_end;
float part_fraction;
bool is_hurried;
#endif

struct Posed {
  vec4 inverse[3];  // rows of world to object at the substep's end
  vec4 change[3];   // rows of the change of the object-to-world matrix in the substep
  vec4 low_cell;    // of a field
  vec4 own;         // of a field xyz nodes, w row; of round solids x the first, y how many, w -1
  vec4 inverse_before[3];  // rows of world to object at the substep's begin
  vec4 sweep;  // x [m^2] squared length up to which paths need not be followed; y above 0: segments
              // collide; z the smallest scale; w [m] its deformation
};

vec4 moment_texel(int substep, int collider, int texel)
{
  int first = {{moment_texels}} + collider * {{collider_texels}};
  return texelFetch(moments, ivec2(first + texel, substep), 0);
}

vec3 moved(vec4 rows[3], vec4 point)
{
  return vec3(dot(rows[0], point), dot(rows[1], point), dot(rows[2], point));
}

Posed posed_at(int substep, int collider)
{
  Posed posed;
  for (int row = 0; row < 3; row++) {
    posed.inverse[row] = moment_texel(substep, collider, row);
    posed.change[row] = moment_texel(substep, collider, 3 + row);
#ifdef HAS_FOLLOWED
    posed.inverse_before[row] = moment_texel(substep, collider, 9 + row);
#endif
  }
  posed.own = moment_texel(substep, collider, 6);
  posed.low_cell = moment_texel(substep, collider, 7);
  posed.sweep = moment_texel(substep, collider, 12);
#ifdef HAS_SHARP
  bool is_part = part_fraction < 1.0;
  for (int row = 0; row < 3; row++) {
    vec4 begin = posed.inverse_before[row];
    vec4 end = posed.inverse[row];
    posed.inverse[row] = is_part ? begin * (1.0 - part_end) + end * part_end : end;
    posed.inverse_before[row] = is_part ? begin * (1.0 - part_begin) + end * part_begin : begin;
    posed.change[row] *= part_fraction;
  }
  posed.sweep.w *= part_fraction;
#endif
  return posed;
}

// How far [m] a point inside a collider may be moved out.
float led_out(Posed posed)
{
#ifdef HAS_SHARP
  return frame.led_out * part_fraction + posed.sweep.w;
#else
  return frame.led_out + posed.sweep.w;
#endif
}

// Distance [m] that a contact must be able to bring a point to, for it to count as touching; kept: the
// distance that the point keeps [m].
float touching_from(float kept)
{
#ifdef HAS_SHARP
  return part_fraction < 1.0 ? 0.0 : kept;
#else
  return kept;
#endif
}

#ifdef HAS_SHARP
// Whether a path in the substep, relative to a collider, is long.
bool is_far(vec3 path)
{
  float far = frame.reach * {{fast_of_reach}} / float(CV_COUNT - 1);
  return dot(path, path) > far * far;
}

// Twin of fast_guides, for one collider.
bool is_root_far(Posed posed)
{
  vec4 local = vec4(moved(posed.inverse, vec4(position[1], 1.0)), 1.0);
  return posed.sweep.y > 0.0 && is_far(position[1] - previous[1] - moved(posed.change, local));
}
#endif

// xyz the world-space normal of an object-space gradient; w the factor from object-space to world-space
// distances. Gradients transform by the inverse transpose; the length of the result gives the factor.
vec4 world_normal(Posed posed, vec3 gradient)
{
  vec3 normal = posed.inverse[0].xyz * gradient.x + posed.inverse[1].xyz * gradient.y +
                posed.inverse[2].xyz * gradient.z;
  float unscaled = 1.0 / max(length(normal), TINY);
  return vec4(normal * unscaled, unscaled);
}

#ifdef HAS_FOLLOWED
struct Met {
  vec3 normal;    // of the surface where the path meets it, or where the path ends
  float surface;  // [m] normal . x of the surface there
  float was;      // [m] from the surface where the path begins
};

// Sphere tracing of a point's path in the substep, relative to the collider, until the distance is
// `reach` [m].
Met followed(Posed posed, vec3 here, vec3 before, float reach)
{
  vec3 begin = moved(posed.inverse_before, vec4(before, 1.0));
  vec3 local = moved(posed.inverse, vec4(here, 1.0));
  Found found = distance_to(posed.own, posed.low_cell, begin);
  float was = found.distance * world_normal(posed, found.gradient).w;
  vec3 path = local - begin;
  float span = length(path) * posed.sweep.z;
  float target = min(reach, was);
  float least = span * (1.0 / float(TRACE_STEPS));
  float place = was > 0.0 ? 1.0 : 0.0;  // along the path; a path that starts inside ends at its start
  if (was > 0.0 && span > TINY) {
    float gone = 0.0;
    float away = was;
    bool goes_on = true;
    int number = 0;
    do {
      float room = away - target;
      float stride = max(room, least);
      float ahead = gone + stride;
      goes_on = ahead < span;
      if (goes_on) {
        float next = distance_to(posed.own, posed.low_cell, begin + path * (ahead / span)).distance * posed.sweep.z;
        if (next < target) {
          place = (ahead - stride + stride * room / max(room - (next - target), TINY)) / span;
          goes_on = false;
        }
        gone = ahead;
        away = next;
      }
      number++;
    } while (goes_on && number < TRACE_STEPS);
  }
  vec3 point = begin + path * place;
  found = distance_to(posed.own, posed.low_cell, point);
  vec4 normal = world_normal(posed, found.gradient);
  float ahead = (dot(found.gradient, point - local) - found.distance) * normal.w;
  return Met(normal.xyz, dot(normal.xyz, here) + ahead, was);
}
#endif

// The next collider, from this one on, near the guide's bounding sphere; frame.collider_count if none.
int next_near(int collider, int substep, float guide_radius)
{
  for (; collider < frame.collider_count; collider++) {
    vec4 sphere = moment_texel(substep, collider, 8);  // around the collider and its reach
    if (distance(sphere.xyz, position[1]) < sphere.w + guide_radius) {
      break;
    }
  }
  return collider;
}

// How far below its plane a point may be when the substep ends [m]; kept: the distance that it keeps [m].
float slack_of(float kept)
{
  return max(kept * {{may_miss}}, 2.0 * SKIN);
}

// Where a new contact goes: x into the first slot; y into the second slot, z and the second slot's old
// contact moves to the first. The shallower of the two old contacts is dropped; slots keep the order of
// the colliders. `first`, `second` and `gap` are how far [m] the point is below the planes of the two
// slots and of the new contact. No branches: compilers would repeat each one for every CV.
bvec3 slots_of(bool is_met, bool is_empty, float first, float second, float gap)
{
  bool is_pressing = is_met && !is_empty && gap > min(first, second);
  return bvec3(is_met && is_empty, is_pressing, is_pressing && first < second);
}

// Put a contact of free CV i into its slot.
void add_contact(int i, bool is_met, vec4 new_plane, vec4 new_origin)
{
#if CONTACT_SLOTS == 1
  plane[0][i] = is_met ? new_plane : plane[0][i];
  origin[0][i] = is_met ? new_origin : origin[0][i];
#else
  vec4 here = vec4(-position[i + 2], 1.0);
  bool is_empty = plane[0][i].w == NO_PLANE;
  bvec3 goes = slots_of(is_met, is_empty, dot(plane[0][i], here), dot(plane[1][i], here), dot(new_plane, here));
  plane[0][i] = goes.x ? new_plane : (goes.z ? plane[1][i] : plane[0][i]);
  origin[0][i] = goes.x ? new_origin : (goes.z ? origin[1][i] : origin[0][i]);
  plane[1][i] = goes.y ? new_plane : plane[1][i];
  origin[1][i] = goes.y ? new_origin : origin[1][i];
#endif
}

// distance_to of many points, each round solid fetched once.
void distances_to(Posed posed, vec4 local[FREE_SIZE], out Found found[FREE_SIZE])
{
#ifdef HAS_ROUNDS
  vec4 nearest[FREE_SIZE];  // xyz from the axis, w radius
  float least[FREE_SIZE];
  for (int i = 0; i < FREE; i++) {
    least[i] = 1.0e30;
  }
  int count = posed.own.w < 0.0 ? int(posed.own.y) : 0;
  for (int k = 0; k < count; k++) {
    Round solid = round_at(int(posed.own.x) + k);
    for (int i = 0; i < FREE; i++) {
      vec3 outward = outward_of(solid, local[i].xyz);
      float away = length(outward) - solid.radius;
      nearest[i] = away < least[i] ? vec4(outward, solid.radius) : nearest[i];
      least[i] = min(away, least[i]);
    }
  }
  for (int i = 0; i < FREE; i++) {
    found[i] = distance_from(nearest[i].xyz, nearest[i].w);
  }
#endif
#ifdef HAS_FIELDS
  Field field = Field(posed.low_cell.xyz, posed.low_cell.w, ivec3(posed.own.xyz), int(posed.own.w));
  for (int i = 0; i < FREE; i++) {
    Found in_field = distance_in(field, local[i].xyz);
#ifdef HAS_ROUNDS
    found[i].distance = posed.own.w >= 0.0 ? in_field.distance : found[i].distance;
    found[i].gradient = posed.own.w >= 0.0 ? in_field.gradient : found[i].gradient;
#else
    found[i] = in_field;
#endif
  }
#endif
}

void find_contacts_with(Posed posed)
{
#ifdef HAS_SHARP
  bool root_is_far = is_root_far(posed);
#endif
  Found found[FREE_SIZE];
  vec4 local[FREE_SIZE];
  for (int i = 0; i < FREE; i++) {
    local[i] = vec4(moved(posed.inverse, vec4(position[i + 2], 1.0)), 1.0);
  }
  distances_to(posed, local, found);
  vec4 surface[FREE_SIZE];  // xyz normal and w surface of Met
  float was[FREE_SIZE];
  bool is_near[FREE_SIZE];
  bool is_fast[FREE_SIZE];
  for (int i = 0; i < FREE; i++) {
    vec4 unscaled = world_normal(posed, found[i].gradient);
    vec3 normal = unscaled.xyz;
    float away = found[i].distance * unscaled.w;
    vec3 path = position[i + 2] - previous[i + 2] - moved(posed.change, local[i]);
    surface[i] = vec4(normal, dot(normal, position[i + 2]) - away);
    was[i] = away - dot(normal, path);
    float beyond = frame.reach;
#ifdef HAS_SHARP
    beyond += posed.sweep.y > 0.0 ? length(path) : 0.0;
#endif
    is_near[i] = away < radius[i] + beyond;
    is_fast[i] = is_near[i] && dot(path, path) > posed.sweep.x;
  }
#ifdef HAS_FOLLOWED
  int fast = next_of(is_fast, -1);
  if (fast < FREE) {
    do {
      vec3 here = picked(position, fast + 2);
      Met met = followed(posed, here, picked(previous, fast + 2), picked(radius, fast));
      for (int i = 0; i < FREE; i++) {
        surface[i] = i == fast ? vec4(met.normal, met.surface) : surface[i];
        was[i] = i == fast ? met.was : was[i];
      }
      fast = next_of(is_fast, fast);
    } while (fast < FREE);
  }
#endif
  for (int i = 0; i < FREE; i++) {
    float reached = was[i] + led_out(posed);
    float offset = surface[i].w + min(radius[i], reached);
    float gap = offset - dot(surface[i].xyz, position[i + 2]);
    bool is_met = is_near[i] && (posed.sweep.y <= 0.0 || gap > -frame.reach);
    vec3 from = previous[i + 2] + moved(posed.change, local[i]);
    float counts = reached >= touching_from(radius[i]) ? SKIN : NO_PLANE;
    add_contact(i, is_met, vec4(surface[i].xyz, offset), vec4(from, counts));
#ifdef HAS_SHARP
    is_hurried = is_hurried || (root_is_far && is_met && is_far(position[i + 2] - from));
#endif
  }
}

#ifdef HAS_SHARP
bool held_at(int i)
{
#ifdef HAS_HELD
  return held[i];
#else
  return false;
#endif
}

// Distance [m] that each sampled point of segment i keeps from colliders.
vec3 between_kept(int i)
{
  vec3 kept = vec3(frame.own[i + 2].y * BETWEEN_RADIUS);
#ifdef HAS_CLEARANCE
  ivec2 texel = strand_texel(int(gl_GlobalInvocationID.x), i + 2, CV_COUNT);
  kept = min(kept, texelFetch(clearances, texel, 0).yzw);
#endif
  return kept;
}

vec3 between(vec3 lower, vec3 upper, float along)
{
  return lower + (upper - lower) * along;
}

// Displacements of the lower (x) and upper (y) CV of segment i for a unit displacement of a point on it.
vec2 weights_of(int i, float along)
{
  float lower = i > 0 && !held_at(max(i - 1, 0)) ? 1.0 - along : 0.0;
  float scale = lower * lower + along * along;
  return vec2(lower / scale, min(along / scale, {{max_weight}}));
}

// [m] that a point of segment i is below a plane.
float gap_between(int i, vec4 surface, float along)
{
  return dot(surface, vec4(-between(position[i + 1], position[i + 2], along), 1.0));
}

// As add_contact, for segment i.
void add_between(int i, bool is_met, vec4 new_plane, vec4 new_origin, float along)
{
#if CONTACT_SLOTS == 1
  between_plane[0][i] = is_met ? new_plane : between_plane[0][i];
  between_origin[0][i] = is_met ? new_origin : between_origin[0][i];
  between_along[0][i] = is_met ? along : between_along[0][i];
#else
  float first = gap_between(i, between_plane[0][i], between_along[0][i]);
  float second = gap_between(i, between_plane[1][i], between_along[1][i]);
  bool is_empty = between_plane[0][i].w == NO_PLANE;
  bvec3 goes = slots_of(is_met, is_empty, first, second, gap_between(i, new_plane, along));
  between_plane[0][i] = goes.x ? new_plane : (goes.z ? between_plane[1][i] : between_plane[0][i]);
  between_origin[0][i] = goes.x ? new_origin : (goes.z ? between_origin[1][i] : between_origin[0][i]);
  between_along[0][i] = goes.x ? along : (goes.z ? between_along[1][i] : between_along[0][i]);
  between_plane[1][i] = goes.y ? new_plane : between_plane[1][i];
  between_origin[1][i] = goes.y ? new_origin : between_origin[1][i];
  between_along[1][i] = goes.y ? along : between_along[1][i];
#endif
}

struct Deepest {
  vec4 plane;
  vec4 origin;
  float along;  // 0: none is near
};

// The one of a few sampled points of a segment that is deepest below its plane.
Deepest deepest_between(Posed posed, int i)
{
  vec3 lower = picked(position, i + 1);
  vec3 upper = picked(position, i + 2);
  vec3 lower_before = picked(previous, i + 1);
  vec3 upper_before = picked(previous, i + 2);
  float own_radius = picked(radius, i);
  vec3 kept = between_kept(i);
  float least = -frame.reach;
  Deepest deepest = Deepest(vec4(0.0), vec4(0.0), 0.0);
  for (int k = 0; k < {{between_count}}; k++) {
    float along = float(k + 1) / float({{between_count}} + 1);
    vec3 here = between(lower, upper, along);
    vec3 before = between(lower_before, upper_before, along);
    Met met = followed(posed, here, before, own_radius);
    float reached = met.was + led_out(posed);
    float offset = met.surface + min(kept[k], reached);
    float gap = offset - dot(met.normal, here);
    if (gap > least) {
      vec3 from = before + moved(posed.change, vec4(moved(posed.inverse, vec4(here, 1.0)), 1.0));
      least = gap;
      deepest = Deepest(vec4(met.normal, offset), vec4(from, reached >= touching_from(kept[k]) ? SKIN : NO_PLANE), along);
    }
  }
  return deepest;
}

void find_between_with(Posed posed)
{
  bool root_is_far = is_root_far(posed);
  Found found[FREE_SIZE];
  vec4 local[FREE_SIZE];
  for (int i = 0; i < FREE; i++) {
    local[i] = vec4(moved(posed.inverse, vec4(0.5 * (position[i + 1] + position[i + 2]), 1.0)), 1.0);
  }
  distances_to(posed, local, found);
  bool is_near[FREE_SIZE];
  Deepest deepest[FREE_SIZE];
  for (int i = 0; i < FREE; i++) {
    vec3 before = 0.5 * (previous[i + 1] + previous[i + 2]) + moved(posed.change, local[i]);
    vec3 path = 0.5 * (position[i + 1] + position[i + 2]) - before;
    float far = radius[i] + frame.reach + 0.5 * length(position[i + 2] - position[i + 1]) + length(path);
    is_near[i] = found[i].distance * world_normal(posed, found[i].gradient).w < far && !held_at(i);
    deepest[i] = Deepest(vec4(0.0), vec4(0.0), 0.0);
  }
  int near = next_of(is_near, -1);
  if (near < FREE) {
    do {
      Deepest there = deepest_between(posed, near);
      for (int i = 0; i < FREE; i++) {
        deepest[i].plane = i == near ? there.plane : deepest[i].plane;
        deepest[i].origin = i == near ? there.origin : deepest[i].origin;
        deepest[i].along = i == near ? there.along : deepest[i].along;
      }
      near = next_of(is_near, near);
    } while (near < FREE);
  }
  for (int i = 0; i < FREE; i++) {
    bool is_met = deepest[i].along > 0.0;
    add_between(i, is_met, deepest[i].plane, deepest[i].origin, deepest[i].along);
    vec3 path = between(position[i + 1], position[i + 2], deepest[i].along) - deepest[i].origin.xyz;
    is_hurried = is_hurried || (root_is_far && is_met && is_far(path));
  }
}
#endif

void find_with(Posed posed)
{
  find_contacts_with(posed);
#ifdef HAS_SHARP
  if (posed.sweep.y > 0.0) {
    find_between_with(posed);
  }
#endif
}

void find_contacts(int substep)
{
#ifdef HAS_SHARP
  is_hurried = false;
#endif
  for (int slot = 0; slot < CONTACT_SLOTS; slot++) {
    for (int i = 0; i < FREE; i++) {
      plane[slot][i] = vec4(0.0, 0.0, 0.0, NO_PLANE);
      origin[slot][i] = vec4(0.0, 0.0, 0.0, NO_PLANE);
      pushed[slot][i] = 0.0;
#ifdef HAS_SHARP
      between_plane[slot][i] = vec4(0.0, 0.0, 0.0, NO_PLANE);
      between_origin[slot][i] = vec4(0.0, 0.0, 0.0, NO_PLANE);
      between_pushed[slot][i] = 0.0;
      between_along[slot][i] = 1.0;
#endif
    }
  }
#if CONTACT_SLOTS == 1
  find_with(posed_at(substep, 0));  // there is only one collider
#else
  float squared = 0.0;
  for (int i = 0; i < FREE; i++) {
    vec3 span = position[i + 2] - position[1];
    squared = max(squared, dot(span, span));
#ifdef HAS_SHARP
    span = previous[i + 2] - position[1];
    squared = max(squared, dot(span, span));
#endif
  }
  float guide_radius = sqrt(squared);
  int collider = next_near(0, substep, guide_radius);
  // drivers on CPUs run a loop once even if its condition is false, so the condition is tested at the end
  if (collider < frame.collider_count) {
    do {
      find_with(posed_at(substep, collider));
      collider = next_near(collider + 1, substep, guide_radius);
    } while (collider < frame.collider_count);
  }
#endif
}

#ifdef HAS_SHARP
// Bring points of segments back to their planes, all contacts of one slot at once. A CV that does not
// touch itself gets the normal of its touching segment.
void push_between(float friction)
{
  for (int i = 0; i < FREE; i++) {
    between_normal[i] = vec3(0.0);
  }
  for (int slot = 0; slot < CONTACT_SLOTS; slot++) {
    vec3 lower = position[1];
    for (int i = 0; i < FREE; i++) {
      vec3 upper = position[i + 2];
      vec3 here = between(lower, upper, between_along[slot][i]);
      vec3 normal = between_plane[slot][i].xyz;
      float gap = between_plane[slot][i].w - dot(normal, here);
      float push = max(gap, 0.0);
      between_pushed[slot][i] += push;
      vec3 there = here + normal * push;
      vec3 slip = there - between_origin[slot][i].xyz;
      slip -= normal * dot(normal, slip);
      there -= slip * min(push * friction / max(length(slip), TINY), 1.0);
      vec2 weights = weights_of(i, between_along[slot][i]);
      position[i + 1] += (there - here) * weights.x;
      position[i + 2] += (there - here) * weights.y;
      bool touches = gap > -between_origin[slot][i].w && between_pushed[slot][i] > 0.0;
      between_normal[i] = touches ? normal : between_normal[i];
      int below = max(i - 1, 0);
      between_normal[below] = touches && weights.x > 0.0 ? normal : between_normal[below];
      lower = upper;
    }
  }
  for (int i = 0; i < FREE; i++) {
    bool touches = dot(touched_normal[i], touched_normal[i]) > 0.0;
    touched_normal[i] = touches ? touched_normal[i] : between_normal[i];
  }
}
#endif

// Bring CVs back to their planes, and set `touched_normal` of those that touch.
void push_out(float friction)
{
  for (int i = 0; i < FREE; i++) {
    touched_normal[i] = vec3(0.0);
  }
  for (int slot = 0; slot < CONTACT_SLOTS; slot++) {
    for (int i = 0; i < FREE; i++) {
      vec3 normal = plane[slot][i].xyz;
      float gap = plane[slot][i].w - dot(normal, position[i + 2]);
      float push = max(gap, 0.0);
      pushed[slot][i] += push;
      position[i + 2] += normal * push;
      vec3 slip = position[i + 2] - origin[slot][i].xyz;
      slip -= normal * dot(normal, slip);
      position[i + 2] -= slip * min(push * friction / max(length(slip), TINY), 1.0);
      touched_normal[i] = gap > -origin[slot][i].w ? normal : touched_normal[i];
    }
  }
#ifdef HAS_SHARP
  push_between(friction);
#endif
}

// Whether any CV or segment is farther below its plane than it may be.
bool is_deep()
{
  bool found = false;
  for (int slot = 0; slot < CONTACT_SLOTS; slot++) {
    for (int i = 0; i < FREE; i++) {
      float gap = dot(plane[slot][i], vec4(-position[i + 2], 1.0));
      found = found || (origin[slot][i].w != NO_PLANE && gap > slack_of(radius[i]));
#ifdef HAS_SHARP
      gap = gap_between(i, between_plane[slot][i], between_along[slot][i]);
      if (between_origin[slot][i].w != NO_PLANE && gap > 2.0 * SKIN) {
        int k = int(between_along[slot][i] * float({{between_count}} + 1) - 0.5);
        found = found || gap > slack_of(between_kept(i)[k]);
      }
#endif
    }
  }
  return found;
}

// Remove the speed that pushing out has added, so that contacts do not bounce.
void absorb()
{
  for (int slot = 0; slot < CONTACT_SLOTS; slot++) {
    for (int i = 0; i < FREE; i++) {
      vec3 normal = plane[slot][i].xyz;
      float away = max(dot(normal, position[i + 2] - origin[slot][i].xyz), 0.0);
      previous[i + 2] += normal * (pushed[slot][i] > 0.0 ? away : 0.0);
#ifdef HAS_SHARP
      normal = between_plane[slot][i].xyz;
      vec3 here = between(position[i + 1], position[i + 2], between_along[slot][i]);
      away = max(dot(normal, here - between_origin[slot][i].xyz), 0.0);
      vec2 weights = weights_of(i, between_along[slot][i]);
      normal *= between_pushed[slot][i] > 0.0 ? away : 0.0;
      previous[i + 1] += normal * weights.x;
      previous[i + 2] += normal * weights.y;
#endif
    }
  }
}
