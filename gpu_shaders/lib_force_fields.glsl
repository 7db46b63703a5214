// The scene's force fields at one CV.
//
// Twin of addon/dynamics/force_fields.py. Needs the block `frame`, and the texture `force_fields`, see
// ForceFields.table: a row with the noise's permutation, then a row for each field with the texels
//     0  xyz the point that it acts from, w kind      1  xyz its normal there, w shape
//     2  xyz its object's position, w strength        3  xyz its object's axis, w damping
//     4  size, flow, fraction across strands, kind of falloff
//     5  falloff by distance: power, near, far; w side
//     6  falloff beside the axis: power, near, far; w 1 inverse square, 2 global
#include "lib_angle.glsl"

#define FIELD_TINY 1.0e-12
#define MAX_FIELD_ACCELERATION 1.0e9

vec3 field_push;         // [m/s^2]
float field_slowing;     // [1/s]
vec3 field_across_push;  // the parts of these two that act across strands only
float field_across_slowing;
vec3 field_spin;         // [1/s]

vec4 field_texel(int field, int texel)
{
  return texelFetch(force_fields, ivec2(texel, field + 1), 0);
}

vec3 field_direction(vec3 vector)
{
  float size = length(vector);
  return size > FIELD_TINY ? vector / size : vec3(0.0);
}

float power_falloff(vec4 falloff, float away)
{
  float beyond = max(away + (1.0 - falloff.y), 1.0);
  return away <= falloff.z ? pow(beyond, -falloff.x) : 0.0;
}

float field_falloff(int field, int kind, float away, vec3 from_center, vec3 normal)
{
  vec4 by_distance = field_texel(field, 5);
  float along = dot(normal, from_center);
  float part;
  if (kind == 0) {
    part = power_falloff(by_distance, away);
  }
  else {
    float wide = length(from_center - normal * along);
    if (kind == 2) {
      float size = max(length(from_center), FIELD_TINY);
      wide = angle_of(wide / size, along / size) * 57.29577951308232;
    }
    part = power_falloff(by_distance, abs(along)) * power_falloff(field_texel(field, 6), wide);
  }
  return along * by_distance.w < 0.0 ? 0.0 : part * frame.wind.w;
}

int permuted(int index)
{
  index &= 255;
  return int(texelFetch(force_fields, ivec2(index / 4, 0), 0)[index % 4]);
}

float noise_gradient(int corner, vec3 offset)
{
  corner &= 15;
  float one = corner < 8 ? offset.x : offset.y;
  float other = corner < 4 ? offset.y : (corner == 12 || corner == 14 ? offset.x : offset.z);
  return ((corner & 1) != 0 ? -one : one) + ((corner & 2) != 0 ? -other : other);
}

float perlin(vec3 point)
{
  vec3 whole = floor(point);
  ivec3 cell = ivec3(mod(whole, 256.0)) & 255;
  vec3 inside = point - whole;
  vec3 fade = inside * inside * inside * (inside * (inside * 6.0 - 15.0) + 10.0);
  vec4 edges;
  for (int i = 0; i < 4; i++) {
    int x = i / 2;
    int y = i % 2;
    int row = permuted(permuted(cell.x + x) + cell.y + y) + cell.z;
    vec3 offset = inside - vec3(x, y, 0);
    float low = noise_gradient(permuted(row), offset);
    float high = noise_gradient(permuted(row + 1), offset - vec3(0, 0, 1));
    edges[i] = mix(low, high, fade.z);
  }
  return mix(mix(edges.x, edges.y, fade.y), mix(edges.z, edges.w, fade.y), fade.x);
}

float octaves_of(vec3 point)
{
  return (perlin(point) + perlin(point * 2.0) * 0.5 + perlin(point * 4.0) * 0.25) * (4.0 / 7.0);
}

vec3 turbulence(vec3 point, float size)
{
  point *= size > 0.0 ? 1.0 / size : 1.0;
  return vec3(octaves_of(point), octaves_of(point.yzx), octaves_of(point.zxy));
}

void add_field(int field, vec3 point, vec3 velocity)
{
  vec4 first = field_texel(field, 0);
  vec4 second = field_texel(field, 1);
  vec4 third = field_texel(field, 2);
  vec4 fourth = field_texel(field, 3);
  vec4 fifth = field_texel(field, 4);
  int kind = int(first.w);
  int shape = int(second.w);
  int options = int(field_texel(field, 6).w);
  vec3 normal = second.xyz;
  vec3 from_center = point - third.xyz;
  vec3 away = point - first.xyz;
  if (shape == {{shape_line}} || shape == {{shape_plane}}) {
    vec3 along = normal * dot(normal, from_center);
    away = shape == {{shape_line}} || kind == {{field_vortex}} ? from_center - along : along;
  }
  float far = length(away);
  float part = field_falloff(field, int(fifth.w), far, from_center, normal);
  if (part <= 0.0) {
    return;
  }
  float strength = part * third.w;
  vec3 push = vec3(0.0);
  float slowing = 0.0;
  if (kind == {{field_wind}}) {
    push = normal * strength;
  }
  else if (kind == {{field_force}}) {
    if ((options & 1) != 0) {
      strength = far > FIELD_TINY ? strength / (far * far + FIELD_TINY) : 0.0;
    }
    push = field_direction(away) * strength;
  }
  else if (kind == {{field_vortex}} && shape == {{shape_point}}) {
    push = field_direction(cross(normal, away)) * (strength * far);
  }
  else if (kind == {{field_vortex}}) {
    vec3 around = cross(fourth.xyz, from_center) * strength;
    push = cross(fourth.xyz, around) * strength + around;
    slowing = 1.0;
  }
  else if (kind == {{field_magnet}}) {
    bool is_around = shape == {{shape_point}} || shape == {{shape_line}};
    field_spin += field_direction(is_around ? cross(normal, away) : normal) * strength;
  }
  else if (kind == {{field_harmonic}}) {
    if (fifth.x > 0.0) {
      away *= (far - fifth.x) / max(far, FIELD_TINY);
    }
    push = away * -strength;
    slowing = fourth.w * 2.0 * sqrt(abs(third.w));
  }
  else if (kind == {{field_turbulence}}) {
    push = turbulence((options & 2) != 0 ? point : from_center + fourth.xyz, fifth.x) * strength;
  }
  else {
    slowing = part * (length(velocity) * min(third.w, 2.0) + min(fourth.w, 2.0));
  }
  if (kind != {{field_harmonic}} && kind != {{field_drag}}) {
    slowing += part * fifth.y;
  }
  field_push += push;
  field_slowing += slowing;
  field_across_push += push * fifth.z;
  field_across_slowing += slowing * fifth.z;
}

float slowing_factor(float slowing)
{
  return slowing > 0.0 ? 1.0 / (1.0 + slowing) : 1.0 - slowing;
}

// Displacement of a CV by all fields in a substep [m]; `along` is the strand's direction there.
vec3 displacement_by_fields(vec3 here, vec3 before, vec3 along)
{
  vec3 velocity = (here - before) / frame.dt;
  field_push = field_across_push = field_spin = vec3(0.0);
  field_slowing = field_across_slowing = 0.0;
  int count = textureSize(force_fields, 0).y - 1;  // one at least
  int field = 0;
  do {
    add_field(field, here, velocity);
    field++;
  } while (field < count);
  field_push = clamp(field_push, -MAX_FIELD_ACCELERATION, MAX_FIELD_ACCELERATION);
  field_across_push = clamp(field_across_push, -MAX_FIELD_ACCELERATION, MAX_FIELD_ACCELERATION);
  vec3 new_velocity = velocity + field_push * frame.dt;
  float straight = dot(new_velocity, along);
  new_velocity = (new_velocity - along * straight) * slowing_factor(field_slowing * frame.dt);
  straight -= dot(field_across_push, along) * frame.dt;
  new_velocity += along * (straight * slowing_factor((field_slowing - field_across_slowing) * frame.dt));
  vec3 turn = clamp(field_spin * frame.dt, -1.0e6, 1.0e6);
  new_velocity = (new_velocity + cross(new_velocity, turn) + turn * dot(new_velocity, turn)) / (dot(turn, turn) + 1.0);
  vec3 displacement = (new_velocity - velocity) * frame.dt;
  return displacement * (frame.springs.w / max(length(displacement), frame.springs.w + FIELD_TINY));
}
