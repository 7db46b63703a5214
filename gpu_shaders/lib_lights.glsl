// Irradiance of the scene's lights. Twin of addon/shading/lights.py and area_lights.py, which state the
// radiometric convention. Needs struct_lights.glsl. Holds no resources.
//
// LIGHT_KINDS, where a recipe defines it: 0 only suns, 1 points and spots as well, 2 area lights too. A
// software driver computes all branches, and area lights cost as much as all other shading.
#include "lib_angle.glsl"
#include "lib_pi.glsl"

#ifndef LIGHT_KINDS
#  define LIGHT_KINDS 2
#endif

const float POINT_LIGHT = 1.0, SPOT_LIGHT = 2.0, RECTANGLE_LIGHT = 3.0, DISK_LIGHT = 4.0;
const float ROUND_GRID_LIGHT = 6.0;
// FAR and MIN_HEIGHT of addon/shading/area_lights.py
const float FAR_PANEL = 2.5e-3, MIN_HEIGHT = 1.0e-9;
// Gauss-Legendre, six nodes on -1 .. 1: these and their mirror images
const vec3 PANEL_NODES = vec3(0.23861918608319692, 0.6612093864662645, 0.932469514203152);
const vec3 PANEL_WEIGHTS = vec3(0.46791393457269104, 0.3607615730481386, 0.17132449237917036);

// Factor of an area light's spread on its radiance, at an angle from its axis with this tangent.
float panel_shade(Lights lights, int index, float tangent)
{
  return max(lights.along[index].w - tangent, 0.0) * lights.power[index].w;
}

// The angle that an edge from start to end subtends, over the distance of its line.
float panel_edge(float height, float across, float start, float end)
{
  float squared = height * height + across * across;
  float lengths = sqrt((squared + start * start) * (squared + end * end));
  float reach = sqrt(squared);
  return angle_of((end - start) * reach / lengths, (squared + start * end) / lengths) / reach;
}

vec3 panel_rectangle(vec2 half_sides, vec3 offset)
{
  float left = -half_sides.x - offset.x, right = half_sides.x - offset.x;
  float bottom = -half_sides.y - offset.y, top = half_sides.y - offset.y;
  float at_left = panel_edge(offset.z, left, bottom, top);
  float at_right = panel_edge(offset.z, right, bottom, top);
  float at_bottom = panel_edge(offset.z, bottom, left, right);
  float at_top = panel_edge(offset.z, top, left, right);
  vec3 total = vec3(offset.z * (at_left - at_right),
                    offset.z * (at_bottom - at_top),
                    left * at_left - right * at_right + bottom * at_bottom - top * at_top);
  return total / (8.0 * PI * half_sides.x * half_sides.y);
}

vec3 panel_disk(float radius, vec3 offset)
{
  float height = offset.z;
  float p = length(offset.xy);
  float product = length(vec2(height, p - radius)) * length(vec2(height, p + radius));
  float total = radius * radius + p * p + height * height + product;
  float rest = radius * radius + height * height - p * p;
  float facing = rest > 0.0 ? product + rest :
                              4.0 * (p * height) * (p * height) / (product - rest);
  return -vec3(2.0 * height * offset.xy, facing) / (PI * total * product);
}

// The part of one row of a panel from low to high, integrated over the sine of the angle at the point.
vec3 panel_row(Lights lights, int index, float height, float v, float low, float high)
{
  float reach = length(vec2(height, v));
  float first = low / length(vec2(reach, low));
  float last = high / length(vec2(reach, high));
  float middle = 0.5 * (first + last), half_width = max(0.5 * (last - first), 0.0);
  vec3 total = vec3(0.0);
  for (int node = 0; node < 6; node++) {
    float sine = middle + (node % 2 == 0 ? -half_width : half_width) * PANEL_NODES[node / 2];
    float cosine = sqrt(max(1.0 - sine * sine, 1e-12));
    float shade = panel_shade(lights, index, length(vec2(reach * sine / cosine, v)) / height);
    vec3 direction = vec3(sine, v / reach * cosine, -height / reach * cosine);
    total += PANEL_WEIGHTS[node / 2] * half_width * shade * direction;
  }
  return total;
}

// Integral, row by row, over the part of a panel in whose cone the point lies.
vec3 panel_grid(Lights lights, int index, bool is_round, vec3 offset)
{
  float a = lights.across[index].w, b = lights.upward[index].w, height = offset.z;
  float reach = height * lights.along[index].w;
  float first = max(-b - offset.y, -reach) / height, last = min(b - offset.y, reach) / height;
  float first_length = length(vec2(1.0, first)), last_length = length(vec2(1.0, last));
  // angles from the panel's plane: those of numpy's arctan plus a quarter turn
  float low_angle = angle_of(1.0 / first_length, -first / first_length);
  float high_angle = angle_of(1.0 / last_length, -last / last_length);
  float middle = 0.5 * (low_angle + high_angle);
  float half_width = max(0.5 * (high_angle - low_angle), 0.0);
  vec3 total = vec3(0.0);
  for (int node = 0; node < 6; node++) {
    float angle = middle + (node % 2 == 0 ? -half_width : half_width) * PANEL_NODES[node / 2];
    float v = -height * cos(angle) / sin(angle);
    float place = (v + offset.y) / b;
    float chord = is_round ? a * sqrt(max(1.0 - place * place, 0.0)) : a;
    float cone = sqrt(max(reach * reach - v * v, 0.0));
    float low = max(-chord - offset.x, -cone), high = min(chord - offset.x, cone);
    total += PANEL_WEIGHTS[node / 2] * half_width *
             panel_row(lights, index, height, v, low, high);
  }
  return total / (PI * 4.0 * a * b * (is_round ? 0.25 * PI : 1.0));
}

// Four points instead of a distant panel, with its variance along each axis.
vec3 panel_four_points(Lights lights, int index, bool is_round, vec2 half_sides, vec3 offset)
{
  vec2 place = half_sides * (is_round ? 0.5 : 0.5773502691896257);
  vec3 total = vec3(0.0);
  for (int corner = 0; corner < 4; corner++) {
    vec2 aside = vec2(corner % 2 == 0 ? -place.x : place.x, corner < 2 ? -place.y : place.y);
    vec3 direction = vec3(aside, 0.0) - offset;
    float squared = dot(direction, direction);
    float shade = panel_shade(lights, index, length(direction.xy) / offset.z);
    total += direction * (offset.z * shade / (4.0 * PI * squared * squared));
  }
  return total;
}

// Vector irradiance of an area light of one watt, towards it, zero behind it [1/m^2].
vec3 panel_vector_irradiance(Lights lights, int index, vec3 away)
{
  mat3 axes = mat3(lights.across[index].xyz, lights.upward[index].xyz, lights.along[index].xyz);
  vec3 offset = -away * axes;
  if (offset.z <= MIN_HEIGHT) {
    return vec3(0.0);
  }
  float shape = lights.vector_and_kind[index].w;
  vec2 half_sides = vec2(lights.across[index].w, lights.upward[index].w);
  bool is_round = shape == ROUND_GRID_LIGHT;
  if (shape == DISK_LIGHT) {
    return axes * panel_disk(half_sides.x, offset);
  }
  float narrow = min(lights.along[index].w, 1.0);
  if (dot(half_sides, half_sides) < FAR_PANEL * narrow * narrow * dot(offset, offset)) {
    return axes * panel_four_points(lights, index, is_round, half_sides, offset);
  }
  if (shape == RECTANGLE_LIGHT) {
    return axes * panel_rectangle(half_sides, offset);
  }
  return axes * panel_grid(lights, index, is_round, offset);
}

// Fraction of light in a spot's cone. width: squared sine of the angle that the light subtends.
float cone_fraction(Lights lights, int index, vec3 away, float width)
{
  float x = -dot(lights.across[index].xyz, away), y = -dot(lights.upward[index].xyz, away);
  float ahead = dot(lights.along[index].xyz, away);
  float aside = x * x + y * y;
  float squared = max(aside + ahead * ahead, 1e-30);
  float reach = sqrt(squared);
  float off_axis = ahead > 0.0 ? aside / (reach * (reach + ahead)) : 1.0 - ahead / reach;
  off_axis += 0.25 * width * (1.0 - off_axis);
  float rim = lights.along[index].w;
  float half_width = sqrt(rim * rim + 1.25 * width * aside / squared);
  float fraction = 0.5 * (lights.upward[index].w + half_width - off_axis) / half_width;
  fraction = clamp(fraction, 0.0, 1.0);
  return fraction * fraction * (3.0 - 2.0 * fraction);
}

// The unit vector to a light (of an area light, to where most of its light comes from), and the irradiance
// on a surface that faces it [W/m^2].
void light_at(Lights lights, int index, vec3 point, out vec3 to_light, out vec3 irradiance)
{
  vec4 light = lights.vector_and_kind[index];
  to_light = light.xyz;
  irradiance = lights.power[index].xyz;
#if LIGHT_KINDS > 0
  if (light.w == 0.0) {
    return;
  }
  vec3 away = light.xyz - point;
  to_light = away * inversesqrt(max(dot(away, away), 1.0e-30));
#  if LIGHT_KINDS > 1
  if (light.w >= RECTANGLE_LIGHT) {
    vec3 arriving = panel_vector_irradiance(lights, index, away);
    float strength = length(arriving);
    to_light = strength > 0.0 ? arriving / strength : to_light;
    irradiance *= strength;
    return;
  }
#  endif
  float added = lights.power[index].w, least = lights.across[index].w;
  float squared = max(dot(away, away) + added, least);
  float cone = 1.0;
  if (light.w == SPOT_LIGHT) {
    cone = cone_fraction(lights, index, away, min((added + least) / squared, 1.0));
  }
  irradiance *= cone / (4.0 * PI * squared);
#endif
}
