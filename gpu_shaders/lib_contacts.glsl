// Contacts: found once in a substep, solved as planes each time lengths and contacts alternate.
//
// Twin of addon/dynamics/contacts.py, over the globals of lib_guide.glsl; see there. Defines:
// CONTACT_SLOTS, how many contacts a CV may have at once; HAS_SHARP, where segments collide too;
// HAS_TRACING, where paths are followed, that is with HAS_SHARP and where colliders are fast;
// HAS_CLEARANCE, where guides keep no more distance than when the motion began. Needs the block
// `frame`, and `substep_table`.
#include "lib_lengths.glsl"
#include "lib_collider.glsl"

#define TOUCH_DISTANCE (frame.contact_margin * {{touch_distance_over_margin}})
#define NO_PLANE -1.0e30
#define SEGMENT_RADIUS {{segment_radius}}
#define MAX_TRACE_STEPS {{max_trace_steps}}

// xyz normal outwards, w offset [m]: keep normal . x >= offset
vec4 plane[CONTACT_SLOTS][FREE_SIZE];
// xyz where the CV would be had it moved with the collider [m]; w distance from the plane within which
// it counts as touching [m], NO_PLANE for never
vec4 origin[CONTACT_SLOTS][FREE_SIZE];
float push_sum[CONTACT_SLOTS][FREE_SIZE];  // [m] in this substep
#ifdef HAS_SHARP
// the same for a point of each segment; segment i ends at free CV i
vec4 segment_plane[CONTACT_SLOTS][FREE_SIZE];
vec4 segment_origin[CONTACT_SLOTS][FREE_SIZE];
float segment_push_sum[CONTACT_SLOTS][FREE_SIZE];
float segment_fraction[CONTACT_SLOTS][FREE_SIZE];  // of the segment at the point
vec3 segment_normal[FREE_SIZE];  // at each free CV with a touching segment, else zero
// Begin, end and length of a part of the substep, as fractions of the substep; and whether the contacts
// found last require the substep to be done in parts.
float part_begin;
float part_end;
float part_fraction;
bool needs_parts;
#endif

struct Pose {
  vec4 inverse[3];       // rows of world to object at the substep's end
  vec4 displacement[3];  // rows of the change of the object-to-world matrix in the substep
  vec4 grid_origin;      // of a field
  vec4 shape;            // of a field xyz nodes, w row; of round solids x the first, y how many, w -1
  vec4 inverse_before[3];  // rows of world to object at the substep's begin
  vec4 tracing;  // x [m^2] squared length up to which paths need not be followed; y above 0: segments
                 // collide; z the smallest scale; w [m] deformation
};

vec4 collider_texel(int substep, int collider, int texel)
{
  int first = {{substep_texels}} + collider * {{collider_texels}};
  return texelFetch(substep_table, ivec2(first + texel, substep), 0);
}

vec3 transform_point(vec4 rows[3], vec4 point)
{
  return vec3(dot(rows[0], point), dot(rows[1], point), dot(rows[2], point));
}

Pose pose_at(int substep, int collider)
{
  Pose pose;
  for (int row = 0; row < 3; row++) {
    pose.inverse[row] = collider_texel(substep, collider, row);
    pose.displacement[row] = collider_texel(substep, collider, 3 + row);
#ifdef HAS_TRACING
    pose.inverse_before[row] = collider_texel(substep, collider, 9 + row);
#endif
  }
  pose.shape = collider_texel(substep, collider, 6);
  pose.grid_origin = collider_texel(substep, collider, 7);
  pose.tracing = collider_texel(substep, collider, 12);
#ifdef HAS_SHARP
  bool is_part = part_fraction < 1.0;
  for (int row = 0; row < 3; row++) {
    vec4 begin = pose.inverse_before[row];
    vec4 end = pose.inverse[row];
    pose.inverse[row] = is_part ? begin * (1.0 - part_end) + end * part_end : end;
    pose.inverse_before[row] = is_part ? begin * (1.0 - part_begin) + end * part_begin : begin;
    pose.displacement[row] *= part_fraction;
  }
  pose.tracing.w *= part_fraction;
#endif
  return pose;
}

// How far [m] a point inside a collider may be moved out.
float max_exit(Pose pose)
{
#ifdef HAS_SHARP
  return frame.max_exit * part_fraction + pose.tracing.w;
#else
  return frame.max_exit + pose.tracing.w;
#endif
}

// Distance [m] that a contact must be able to bring a point to, for it to count as touching. clearance:
// the distance that the point keeps [m].
float min_touching_exit(float clearance)
{
#ifdef HAS_SHARP
  return part_fraction < 1.0 ? 0.0 : clearance;
#else
  return clearance;
#endif
}

#ifdef HAS_SHARP
// Whether a path in the substep, relative to a collider, is long.
bool is_long(vec3 path)
{
  float far = frame.contact_margin * {{fast_segments_over_margin}} / float(CV_COUNT - 1);
  return dot(path, path) > far * far;
}

// Twin of fast_guides, for one collider.
bool is_root_fast(Pose pose)
{
  vec4 local = vec4(transform_point(pose.inverse, vec4(position[1], 1.0)), 1.0);
  return pose.tracing.y > 0.0 && is_long(position[1] - previous[1] - transform_point(pose.displacement, local));
}
#endif

// xyz the world-space normal of an object-space gradient; w the factor from object-space to world-space
// distances. Gradients transform by the inverse transpose; the length of the result gives the factor.
vec4 world_normal(Pose pose, vec3 gradient)
{
  vec3 normal = pose.inverse[0].xyz * gradient.x + pose.inverse[1].xyz * gradient.y +
                pose.inverse[2].xyz * gradient.z;
  float unscaled = 1.0 / max(length(normal), TINY);
  return vec4(normal * unscaled, unscaled);
}

#ifdef HAS_TRACING
struct TracedPath {
  vec3 normal;           // of the surface where the path meets it, or where the path ends
  float surface;         // [m] normal . x of the surface there
  float start_distance;  // [m] from the surface where the path begins
};

// Sphere tracing of a point's path in the substep, relative to the collider, until the distance is
// `reach` [m].
TracedPath trace_path(Pose pose, vec3 here, vec3 before, float reach)
{
  vec3 begin = transform_point(pose.inverse_before, vec4(before, 1.0));
  vec3 local = transform_point(pose.inverse, vec4(here, 1.0));
  SignedDistance found = collider_distance(pose.shape, pose.grid_origin, begin);
  float start_distance = found.distance * world_normal(pose, found.gradient).w;
  vec3 path = local - begin;
  float span = length(path) * pose.tracing.z;
  float target = min(reach, start_distance);
  float least = span * (1.0 / float(MAX_TRACE_STEPS));
  float path_fraction = start_distance > 0.0 ? 1.0 : 0.0;  // along the path; a path that starts inside ends at its start
  if (start_distance > 0.0 && span > TINY) {
    float travelled = 0.0;
    float away = start_distance;
    bool is_active = true;
    int number = 0;
    do {
      float free_distance = away - target;
      float step_length = max(free_distance, least);
      float next_travelled = travelled + step_length;
      is_active = next_travelled < span;
      if (is_active) {
        float next_distance = collider_distance(pose.shape, pose.grid_origin, begin + path * (next_travelled / span)).distance * pose.tracing.z;
        if (next_distance < target) {
          path_fraction = (next_travelled - step_length + step_length * free_distance / max(free_distance - (next_distance - target), TINY)) / span;
          is_active = false;
        }
        travelled = next_travelled;
        away = next_distance;
      }
      number++;
    } while (is_active && number < MAX_TRACE_STEPS);
  }
  vec3 point = begin + path * path_fraction;
  found = collider_distance(pose.shape, pose.grid_origin, point);
  vec4 normal = world_normal(pose, found.gradient);
  float offset = (dot(found.gradient, point - local) - found.distance) * normal.w;
  return TracedPath(normal.xyz, dot(normal.xyz, here) + offset, start_distance);
}
#endif

// The next collider, from this one on, near the guide's bounding sphere; frame.collider_count if none.
int next_near_collider(int collider, int substep, float guide_radius)
{
  for (; collider < frame.collider_count; collider++) {
    vec4 sphere = collider_texel(substep, collider, 8);  // around the collider and its reach
    if (distance(sphere.xyz, position[1]) < sphere.w + guide_radius) {
      break;
    }
  }
  return collider;
}

// How far below its plane a point may be when the substep ends [m]. clearance: the distance that it keeps
// [m].
float allowed_depth(float clearance)
{
  return max(clearance * {{allowed_depth}}, 2.0 * TOUCH_DISTANCE);
}

// Where a new contact goes: x into the first slot; y into the second slot, z and the second slot's old
// contact moves to the first. The shallower of the two old contacts is dropped; slots keep the order of
// the colliders. `first`, `second` and `gap` are how far [m] the point is below the planes of the two
// slots and of the new contact. No branches: compilers would repeat each one for every CV.
bvec3 slots_of(bool is_contact, bool is_empty, float first, float second, float gap)
{
  bool is_pressing = is_contact && !is_empty && gap > min(first, second);
  return bvec3(is_contact && is_empty, is_pressing, is_pressing && first < second);
}

// Put a contact of free CV i into its slot.
void add_contact(int i, bool is_contact, vec4 new_plane, vec4 new_origin)
{
#if CONTACT_SLOTS == 1
  plane[0][i] = is_contact ? new_plane : plane[0][i];
  origin[0][i] = is_contact ? new_origin : origin[0][i];
#else
  vec4 here = vec4(-position[i + 2], 1.0);
  bool is_empty = plane[0][i].w == NO_PLANE;
  bvec3 moves = slots_of(is_contact, is_empty, dot(plane[0][i], here), dot(plane[1][i], here), dot(new_plane, here));
  plane[0][i] = moves.x ? new_plane : (moves.z ? plane[1][i] : plane[0][i]);
  origin[0][i] = moves.x ? new_origin : (moves.z ? origin[1][i] : origin[0][i]);
  plane[1][i] = moves.y ? new_plane : plane[1][i];
  origin[1][i] = moves.y ? new_origin : origin[1][i];
#endif
}

// collider_distance of many points, each round solid fetched once.
void collider_distances(Pose pose, vec4 local[FREE_SIZE], out SignedDistance found[FREE_SIZE])
{
#ifdef HAS_ROUNDS
  vec4 nearest[FREE_SIZE];  // xyz from the axis, w radius
  float least[FREE_SIZE];
  for (int i = 0; i < FREE_COUNT; i++) {
    least[i] = 1.0e30;
  }
  int count = pose.shape.w < 0.0 ? int(pose.shape.y) : 0;
  for (int k = 0; k < count; k++) {
    Round solid = round_at(int(pose.shape.x) + k);
    for (int i = 0; i < FREE_COUNT; i++) {
      vec3 outward = outward_of(solid, local[i].xyz);
      float away = length(outward) - solid.radius;
      nearest[i] = away < least[i] ? vec4(outward, solid.radius) : nearest[i];
      least[i] = min(away, least[i]);
    }
  }
  for (int i = 0; i < FREE_COUNT; i++) {
    found[i] = round_distance(nearest[i].xyz, nearest[i].w);
  }
#endif
#ifdef HAS_FIELDS
  Field field = Field(pose.grid_origin.xyz, pose.grid_origin.w, ivec3(pose.shape.xyz), int(pose.shape.w));
  for (int i = 0; i < FREE_COUNT; i++) {
    SignedDistance of_field = field_distance(field, local[i].xyz);
#ifdef HAS_ROUNDS
    found[i].distance = pose.shape.w >= 0.0 ? of_field.distance : found[i].distance;
    found[i].gradient = pose.shape.w >= 0.0 ? of_field.gradient : found[i].gradient;
#else
    found[i] = of_field;
#endif
  }
#endif
}

void find_contacts_with(Pose pose)
{
#ifdef HAS_SHARP
  bool root_is_fast = is_root_fast(pose);
#endif
  SignedDistance found[FREE_SIZE];
  vec4 local[FREE_SIZE];
  for (int i = 0; i < FREE_COUNT; i++) {
    local[i] = vec4(transform_point(pose.inverse, vec4(position[i + 2], 1.0)), 1.0);
  }
  collider_distances(pose, local, found);
  vec4 surface[FREE_SIZE];  // xyz normal and w surface of TracedPath
  float start_distance[FREE_SIZE];
  bool is_near[FREE_SIZE];
  bool is_fast[FREE_SIZE];
  for (int i = 0; i < FREE_COUNT; i++) {
    vec4 unscaled = world_normal(pose, found[i].gradient);
    vec3 normal = unscaled.xyz;
    float away = found[i].distance * unscaled.w;
    vec3 path = position[i + 2] - previous[i + 2] - transform_point(pose.displacement, local[i]);
    surface[i] = vec4(normal, dot(normal, position[i + 2]) - away);
    start_distance[i] = away - dot(normal, path);
    float margin = frame.contact_margin;
#ifdef HAS_SHARP
    margin += pose.tracing.y > 0.0 ? length(path) : 0.0;
#endif
    is_near[i] = away < radius[i] + margin;
    is_fast[i] = is_near[i] && dot(path, path) > pose.tracing.x;
  }
#ifdef HAS_TRACING
  int fast = next_set(is_fast, -1);
  if (fast < FREE_COUNT) {
    do {
      vec3 here = element_at(position, fast + 2);
      TracedPath traced = trace_path(pose, here, element_at(previous, fast + 2), element_at(radius, fast));
      for (int i = 0; i < FREE_COUNT; i++) {
        surface[i] = i == fast ? vec4(traced.normal, traced.surface) : surface[i];
        start_distance[i] = i == fast ? traced.start_distance : start_distance[i];
      }
      fast = next_set(is_fast, fast);
    } while (fast < FREE_COUNT);
  }
#endif
  for (int i = 0; i < FREE_COUNT; i++) {
    float allowed_clearance = start_distance[i] + max_exit(pose);
    float offset = surface[i].w + min(radius[i], allowed_clearance);
    float gap = offset - dot(surface[i].xyz, position[i + 2]);
    bool is_contact = is_near[i] && (pose.tracing.y <= 0.0 || gap > -frame.contact_margin);
    vec3 from = previous[i + 2] + transform_point(pose.displacement, local[i]);
    float touch_distance = allowed_clearance >= min_touching_exit(radius[i]) ? TOUCH_DISTANCE : NO_PLANE;
    add_contact(i, is_contact, vec4(surface[i].xyz, offset), vec4(from, touch_distance));
#ifdef HAS_SHARP
    needs_parts = needs_parts || (root_is_fast && is_contact && is_long(position[i + 2] - from));
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
vec3 segment_clearance(int i)
{
  vec3 clearance = vec3(frame.stiffness_and_radius[i + 2].y * SEGMENT_RADIUS);
#ifdef HAS_CLEARANCE
  ivec2 texel = strand_texel(int(gl_GlobalInvocationID.x), i + 2, CV_COUNT);
  clearance = min(clearance, texelFetch(clearances, texel, 0).yzw);
#endif
  return clearance;
}

vec3 point_between(vec3 lower, vec3 upper, float along)
{
  return lower + (upper - lower) * along;
}

// Displacements of the lower (x) and upper (y) CV of segment i for a unit displacement of a point on it.
vec2 weights_of(int i, float along)
{
  float lower = i > 0 && !held_at(max(i - 1, 0)) ? 1.0 - along : 0.0;
  float scale = lower * lower + along * along;
  return vec2(lower / scale, min(along / scale, {{max_segment_weight}}));
}

// [m] that a point of segment i is below a plane.
float segment_gap(int i, vec4 surface, float along)
{
  return dot(surface, vec4(-point_between(position[i + 1], position[i + 2], along), 1.0));
}

// As add_contact, for segment i.
void add_segment_contact(int i, bool is_contact, vec4 new_plane, vec4 new_origin, float along)
{
#if CONTACT_SLOTS == 1
  segment_plane[0][i] = is_contact ? new_plane : segment_plane[0][i];
  segment_origin[0][i] = is_contact ? new_origin : segment_origin[0][i];
  segment_fraction[0][i] = is_contact ? along : segment_fraction[0][i];
#else
  float first = segment_gap(i, segment_plane[0][i], segment_fraction[0][i]);
  float second = segment_gap(i, segment_plane[1][i], segment_fraction[1][i]);
  bool is_empty = segment_plane[0][i].w == NO_PLANE;
  bvec3 moves = slots_of(is_contact, is_empty, first, second, segment_gap(i, new_plane, along));
  segment_plane[0][i] = moves.x ? new_plane : (moves.z ? segment_plane[1][i] : segment_plane[0][i]);
  segment_origin[0][i] = moves.x ? new_origin : (moves.z ? segment_origin[1][i] : segment_origin[0][i]);
  segment_fraction[0][i] = moves.x ? along : (moves.z ? segment_fraction[1][i] : segment_fraction[0][i]);
  segment_plane[1][i] = moves.y ? new_plane : segment_plane[1][i];
  segment_origin[1][i] = moves.y ? new_origin : segment_origin[1][i];
  segment_fraction[1][i] = moves.y ? along : segment_fraction[1][i];
#endif
}

struct SegmentContact {
  vec4 plane;
  vec4 origin;
  float along;  // 0: none is near
};

// The one of a few sampled points of a segment that is deepest below its plane.
SegmentContact deepest_segment_contact(Pose pose, int i)
{
  vec3 lower = element_at(position, i + 1);
  vec3 upper = element_at(position, i + 2);
  vec3 lower_before = element_at(previous, i + 1);
  vec3 upper_before = element_at(previous, i + 2);
  float own_radius = element_at(radius, i);
  vec3 clearance = segment_clearance(i);
  float least = -frame.contact_margin;
  SegmentContact deepest = SegmentContact(vec4(0.0), vec4(0.0), 0.0);
  for (int k = 0; k < {{segment_point_count}}; k++) {
    float along = float(k + 1) / float({{segment_point_count}} + 1);
    vec3 here = point_between(lower, upper, along);
    vec3 before = point_between(lower_before, upper_before, along);
    TracedPath traced = trace_path(pose, here, before, own_radius);
    float allowed_clearance = traced.start_distance + max_exit(pose);
    float offset = traced.surface + min(clearance[k], allowed_clearance);
    float gap = offset - dot(traced.normal, here);
    if (gap > least) {
      vec3 from = before + transform_point(pose.displacement, vec4(transform_point(pose.inverse, vec4(here, 1.0)), 1.0));
      least = gap;
      deepest = SegmentContact(vec4(traced.normal, offset), vec4(from, allowed_clearance >= min_touching_exit(clearance[k]) ? TOUCH_DISTANCE : NO_PLANE), along);
    }
  }
  return deepest;
}

void find_segment_contacts_with(Pose pose)
{
  bool root_is_fast = is_root_fast(pose);
  SignedDistance found[FREE_SIZE];
  vec4 local[FREE_SIZE];
  for (int i = 0; i < FREE_COUNT; i++) {
    local[i] = vec4(transform_point(pose.inverse, vec4(0.5 * (position[i + 1] + position[i + 2]), 1.0)), 1.0);
  }
  collider_distances(pose, local, found);
  bool is_near[FREE_SIZE];
  SegmentContact deepest[FREE_SIZE];
  for (int i = 0; i < FREE_COUNT; i++) {
    vec3 before = 0.5 * (previous[i + 1] + previous[i + 2]) + transform_point(pose.displacement, local[i]);
    vec3 path = 0.5 * (position[i + 1] + position[i + 2]) - before;
    float far = radius[i] + frame.contact_margin + 0.5 * length(position[i + 2] - position[i + 1]) + length(path);
    is_near[i] = found[i].distance * world_normal(pose, found[i].gradient).w < far && !held_at(i);
    deepest[i] = SegmentContact(vec4(0.0), vec4(0.0), 0.0);
  }
  int near = next_set(is_near, -1);
  if (near < FREE_COUNT) {
    do {
      SegmentContact there = deepest_segment_contact(pose, near);
      for (int i = 0; i < FREE_COUNT; i++) {
        deepest[i].plane = i == near ? there.plane : deepest[i].plane;
        deepest[i].origin = i == near ? there.origin : deepest[i].origin;
        deepest[i].along = i == near ? there.along : deepest[i].along;
      }
      near = next_set(is_near, near);
    } while (near < FREE_COUNT);
  }
  for (int i = 0; i < FREE_COUNT; i++) {
    bool is_contact = deepest[i].along > 0.0;
    add_segment_contact(i, is_contact, deepest[i].plane, deepest[i].origin, deepest[i].along);
    vec3 path = point_between(position[i + 1], position[i + 2], deepest[i].along) - deepest[i].origin.xyz;
    needs_parts = needs_parts || (root_is_fast && is_contact && is_long(path));
  }
}
#endif

void find_with(Pose pose)
{
  find_contacts_with(pose);
#ifdef HAS_SHARP
  if (pose.tracing.y > 0.0) {
    find_segment_contacts_with(pose);
  }
#endif
}

void find_contacts(int substep)
{
#ifdef HAS_SHARP
  needs_parts = false;
#endif
  for (int slot = 0; slot < CONTACT_SLOTS; slot++) {
    for (int i = 0; i < FREE_COUNT; i++) {
      plane[slot][i] = vec4(0.0, 0.0, 0.0, NO_PLANE);
      origin[slot][i] = vec4(0.0, 0.0, 0.0, NO_PLANE);
      push_sum[slot][i] = 0.0;
#ifdef HAS_SHARP
      segment_plane[slot][i] = vec4(0.0, 0.0, 0.0, NO_PLANE);
      segment_origin[slot][i] = vec4(0.0, 0.0, 0.0, NO_PLANE);
      segment_push_sum[slot][i] = 0.0;
      segment_fraction[slot][i] = 1.0;
#endif
    }
  }
#if CONTACT_SLOTS == 1
  find_with(pose_at(substep, 0));  // there is only one collider
#else
  float squared = 0.0;
  for (int i = 0; i < FREE_COUNT; i++) {
    vec3 span = position[i + 2] - position[1];
    squared = max(squared, dot(span, span));
#ifdef HAS_SHARP
    span = previous[i + 2] - position[1];
    squared = max(squared, dot(span, span));
#endif
  }
  float guide_radius = sqrt(squared);
  int collider = next_near_collider(0, substep, guide_radius);
  // drivers on CPUs run a loop once even if its condition is false, so the condition is tested at the end
  if (collider < frame.collider_count) {
    do {
      find_with(pose_at(substep, collider));
      collider = next_near_collider(collider + 1, substep, guide_radius);
    } while (collider < frame.collider_count);
  }
#endif
}

#ifdef HAS_SHARP
// Bring points of segments back to their planes, all contacts of one slot at once. A CV that does not
// touch itself gets the normal of its touching segment.
void push_segments_out(float friction)
{
  for (int i = 0; i < FREE_COUNT; i++) {
    segment_normal[i] = vec3(0.0);
  }
  for (int slot = 0; slot < CONTACT_SLOTS; slot++) {
    vec3 lower = position[1];
    for (int i = 0; i < FREE_COUNT; i++) {
      vec3 upper = position[i + 2];
      vec3 here = point_between(lower, upper, segment_fraction[slot][i]);
      vec3 normal = segment_plane[slot][i].xyz;
      float gap = segment_plane[slot][i].w - dot(normal, here);
      float push = max(gap, 0.0);
      segment_push_sum[slot][i] += push;
      vec3 there = here + normal * push;
      vec3 slip = there - segment_origin[slot][i].xyz;
      slip -= normal * dot(normal, slip);
      there -= slip * min(push * friction / max(length(slip), TINY), 1.0);
      vec2 weights = weights_of(i, segment_fraction[slot][i]);
      position[i + 1] += (there - here) * weights.x;
      position[i + 2] += (there - here) * weights.y;
      bool touches = gap > -segment_origin[slot][i].w && segment_push_sum[slot][i] > 0.0;
      segment_normal[i] = touches ? normal : segment_normal[i];
      int below = max(i - 1, 0);
      segment_normal[below] = touches && weights.x > 0.0 ? normal : segment_normal[below];
      lower = upper;
    }
  }
  for (int i = 0; i < FREE_COUNT; i++) {
    bool touches = dot(touched_normal[i], touched_normal[i]) > 0.0;
    touched_normal[i] = touches ? touched_normal[i] : segment_normal[i];
  }
}
#endif

// Bring CVs back to their planes, and set `touched_normal` of those that touch.
void push_out(float friction)
{
  for (int i = 0; i < FREE_COUNT; i++) {
    touched_normal[i] = vec3(0.0);
  }
  for (int slot = 0; slot < CONTACT_SLOTS; slot++) {
    for (int i = 0; i < FREE_COUNT; i++) {
      vec3 normal = plane[slot][i].xyz;
      float gap = plane[slot][i].w - dot(normal, position[i + 2]);
      float push = max(gap, 0.0);
      push_sum[slot][i] += push;
      position[i + 2] += normal * push;
      vec3 slip = position[i + 2] - origin[slot][i].xyz;
      slip -= normal * dot(normal, slip);
      position[i + 2] -= slip * min(push * friction / max(length(slip), TINY), 1.0);
      touched_normal[i] = gap > -origin[slot][i].w ? normal : touched_normal[i];
    }
  }
#ifdef HAS_SHARP
  push_segments_out(friction);
#endif
}

// Whether any CV or segment is farther below its plane than it may be.
bool is_too_deep()
{
  bool found = false;
  for (int slot = 0; slot < CONTACT_SLOTS; slot++) {
    for (int i = 0; i < FREE_COUNT; i++) {
      float gap = dot(plane[slot][i], vec4(-position[i + 2], 1.0));
      found = found || (origin[slot][i].w != NO_PLANE && gap > allowed_depth(radius[i]));
#ifdef HAS_SHARP
      gap = segment_gap(i, segment_plane[slot][i], segment_fraction[slot][i]);
      if (segment_origin[slot][i].w != NO_PLANE && gap > 2.0 * TOUCH_DISTANCE) {
        int k = int(segment_fraction[slot][i] * float({{segment_point_count}} + 1) - 0.5);
        found = found || gap > allowed_depth(segment_clearance(i)[k]);
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
    for (int i = 0; i < FREE_COUNT; i++) {
      vec3 normal = plane[slot][i].xyz;
      float away = max(dot(normal, position[i + 2] - origin[slot][i].xyz), 0.0);
      previous[i + 2] += normal * (push_sum[slot][i] > 0.0 ? away : 0.0);
#ifdef HAS_SHARP
      normal = segment_plane[slot][i].xyz;
      vec3 here = point_between(position[i + 1], position[i + 2], segment_fraction[slot][i]);
      away = max(dot(normal, here - segment_origin[slot][i].xyz), 0.0);
      vec2 weights = weights_of(i, segment_fraction[slot][i]);
      normal *= segment_push_sum[slot][i] > 0.0 ? away : 0.0;
      previous[i + 1] += normal * weights.x;
      previous[i + 2] += normal * weights.y;
#endif
    }
  }
}
