// Contacts: found once in a substep, solved as planes each time lengths and contacts alternate.
//
// Twin of addon/dynamics/contacts.py, over the globals of lib_guide.glsl; see there. Defines:
// CONTACT_SLOTS, how many contacts a CV may have at once. Needs the block `frame`, and `moments`.
#include "lib_lengths.glsl"
#include "lib_collider.glsl"

#define SKIN (frame.reach * {{skin_of_reach}})
#define NO_PLANE -1.0e30

// xyz normal outwards, w offset [m]: keep normal . x >= offset
vec4 plane[CONTACT_SLOTS][FREE_SIZE];
// xyz where the CV would be had it stayed with the collider [m]; w how far from the plane it still
// counts as touching [m], NO_PLANE for never
vec4 origin[CONTACT_SLOTS][FREE_SIZE];
float pushed[CONTACT_SLOTS][FREE_SIZE];  // [m] in this substep

struct Posed {
  vec4 inverse[3];  // rows of world to object at the substep's end
  vec4 change[3];   // rows of what the substep changes in object to world
  vec4 low_cell;    // of a field
  ivec4 own;        // of a field xyz nodes, w row; of round solids x the first, y how many, w -1
};

vec4 moment_texel(int substep, int collider, int texel)
{
  int first = {{moment_texels}} + collider * {{collider_texels}};
  return texelFetch(moments, ivec2(first + texel, substep), 0);
}

Posed posed_at(int substep, int collider)
{
  Posed posed;
  for (int row = 0; row < 3; row++) {
    posed.inverse[row] = moment_texel(substep, collider, row);
    posed.change[row] = moment_texel(substep, collider, 3 + row);
  }
  posed.own = ivec4(moment_texel(substep, collider, 6));
#ifdef HAS_FIELDS
  posed.low_cell = moment_texel(substep, collider, 7);
#endif
  return posed;
}

vec3 moved(vec4 rows[3], vec4 point)
{
  return vec3(dot(rows[0], point), dot(rows[1], point), dot(rows[2], point));
}

// The next collider, from this one on, that is near the guide's bounding sphere; else their number.
int next_near(int collider, int substep, float guide_radius)
{
  for (; collider < frame.collider_count; collider++) {
    vec4 sphere = moment_texel(substep, collider, 8);  // around the collider, with all reach
    if (distance(sphere.xyz, position[1]) < sphere.w + guide_radius) {
      break;
    }
  }
  return collider;
}

// Put a contact of free CV i where there is room; else in place of the less pressing one of the
// two, in the order of the colliders.
void add_contact(int i, vec4 new_plane, vec4 new_origin)
{
#if CONTACT_SLOTS == 1
  plane[0][i] = new_plane;
  origin[0][i] = new_origin;
#else
  vec4 here = vec4(-position[i + 2], 1.0);
  float first = dot(plane[0][i], here);
  float second = dot(plane[1][i], here);
  if (plane[0][i].w == NO_PLANE) {
    plane[0][i] = new_plane;
    origin[0][i] = new_origin;
  }
  else if (dot(new_plane, here) > min(first, second)) {
    if (first < second) {
      plane[0][i] = plane[1][i];
      origin[0][i] = origin[1][i];
    }
    plane[1][i] = new_plane;
    origin[1][i] = new_origin;
  }
#endif
}

void find_contacts_with(Posed posed)
{
  Found found[FREE_SIZE];
  vec4 local[FREE_SIZE];
  for (int i = 0; i < FREE; i++) {
    local[i] = vec4(moved(posed.inverse, vec4(position[i + 2], 1.0)), 1.0);
  }
#ifdef HAS_ROUNDS
  vec4 nearest[FREE_SIZE];  // xyz from the axis, w radius
  float least[FREE_SIZE];
  for (int i = 0; i < FREE; i++) {
    least[i] = 1.0e30;
  }
  int count = posed.own.w < 0 ? posed.own.y : 0;
  for (int k = 0; k < count; k++) {
    Round solid = round_at(posed.own.x + k);
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
  Field field = Field(posed.low_cell.xyz, posed.low_cell.w, posed.own.xyz, posed.own.w);
  for (int i = 0; i < FREE; i++) {
    Found in_field = distance_in(field, local[i].xyz);
#ifdef HAS_ROUNDS
    found[i].distance = posed.own.w >= 0 ? in_field.distance : found[i].distance;
    found[i].gradient = posed.own.w >= 0 ? in_field.gradient : found[i].gradient;
#else
    found[i] = in_field;
#endif
  }
#endif
  for (int i = 0; i < FREE; i++) {
    // distance and normal in the world: the gradient transforms by the inverse transposed, and its
    // length says how much the distance is scaled along it
    vec3 gradient = found[i].gradient;
    vec3 normal = posed.inverse[0].xyz * gradient.x + posed.inverse[1].xyz * gradient.y +
                  posed.inverse[2].xyz * gradient.z;
    float unscaled = 1.0 / max(length(normal), TINY);
    normal *= unscaled;
    float away = found[i].distance * unscaled;
    vec3 from = previous[i + 2] + moved(posed.change, local[i]);
    float height = dot(normal, position[i + 2]);
    float reached = away - dot(normal, position[i + 2] - from) + frame.led_out;
    float offset = height - away + min(radius[i], reached);
    if (away < radius[i] + frame.reach) {
      add_contact(i, vec4(normal, offset), vec4(from, reached >= radius[i] ? SKIN : NO_PLANE));
    }
  }
}

void find_contacts(int substep)
{
  for (int slot = 0; slot < CONTACT_SLOTS; slot++) {
    for (int i = 0; i < FREE; i++) {
      plane[slot][i] = vec4(0.0, 0.0, 0.0, NO_PLANE);
      origin[slot][i] = vec4(0.0, 0.0, 0.0, NO_PLANE);
      pushed[slot][i] = 0.0;
    }
  }
#if CONTACT_SLOTS == 1
  find_contacts_with(posed_at(substep, 0));  // there is but one collider
#else
  float squared = 0.0;
  for (int i = 0; i < FREE; i++) {
    vec3 span = position[i + 2] - position[1];
    squared = max(squared, dot(span, span));
  }
  float guide_radius = sqrt(squared);
  int collider = next_near(0, substep, guide_radius);
  // drivers on CPUs run a loop once even if nothing is left to do, so it is asked at the end
  if (collider < frame.collider_count) {
    do {
      find_contacts_with(posed_at(substep, collider));
      collider = next_near(collider + 1, substep, guide_radius);
    } while (collider < frame.collider_count);
  }
#endif
}

// Bring CVs back to their planes, and say which ones touch.
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
}

// Take away the speed that pushing out has made: contacts do not bounce.
void absorb()
{
  for (int slot = 0; slot < CONTACT_SLOTS; slot++) {
    for (int i = 0; i < FREE; i++) {
      vec3 normal = plane[slot][i].xyz;
      float away = max(dot(normal, position[i + 2] - origin[slot][i].xyz), 0.0);
      previous[i + 2] += normal * (pushed[slot][i] > 0.0 ? away : 0.0);
    }
  }
}
