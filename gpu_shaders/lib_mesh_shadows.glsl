// Shadows of meshes on meshes, from shadow maps of their depths.
//
// Twin of addon/shading/volume/mesh_light.py: same order; a test compares the two. Reads the
// block `mesh_shadows` and the texture array `mesh_depths`.

// Place in a map before the division by w, and w, which is not positive behind the light.
vec3 mesh_map_place(int map, vec3 point)
{
  vec4 world = vec4(point, 1.0);
  return vec3(dot(mesh_shadows.map_x[map], world),
              dot(mesh_shadows.map_y[map], world),
              dot(mesh_shadows.map_w[map], world));
}

// The map of a light in which a point lies; -1 for none.
int mesh_map_at(int light, vec3 point)
{
  int first = int(mesh_shadows.light[light].x), count = int(mesh_shadows.light[light].y);
  int found = -1;
  for (int map = first; map < first + count; map++) {
    vec3 place = mesh_map_place(map, point);
    found = max(abs(place.x), abs(place.y)) <= place.z ? map : found;
  }
  return found;
}

// xy change of depth per texel on the plane through a point, z depth that equals the width of a texel.
vec3 mesh_slope(int map, vec3 place, vec3 normal)
{
  float w = max(abs(place.z), 1.0e-6);
  vec3 across = (mesh_shadows.map_x[map].xyz - place.x * mesh_shadows.map_w[map].xyz) / w;
  vec3 upward = (mesh_shadows.map_y[map].xyz - place.y * mesh_shadows.map_w[map].xyz) / w;
  vec3 ray = cross(across, upward), deeper = mesh_shadows.map_depth[map].xyz;
  float size = length(ray);
  float cosine = dot(normal, ray) / size;
  cosine = (cosine < 0.0 ? -1.0 : 1.0) * max(abs(cosine), {{min_mesh_cosine}});
  float texel = 2.0 / mesh_shadows.resolution;
  vec2 slope = vec2(dot(cross(upward, normal), deeper), dot(cross(normal, across), deeper));
  slope *= texel / (size * cosine);
  float unit = texel * length(deeper) * inversesqrt(size);
  return vec3(slope / max(length(slope) / ({{max_mesh_slope}} * unit), 1.0), unit);
}

// The fraction of a light that reaches a point. normal: of its triangle, of any sign and length.
float mesh_light(int light, vec3 point, vec3 normal)
{
  int map = mesh_map_at(light, point);
  if (map < 0) {
    return 1.0;
  }
  vec3 place = mesh_map_place(map, point);
  place.xy /= max(place.z, 1.0e-6);
  vec3 unit_normal = normal * inversesqrt(max(dot(normal, normal), 1.0e-36));
  vec3 slope = mesh_slope(map, place, unit_normal);
  float depth = dot(mesh_shadows.map_depth[map], vec4(point, 1.0));
  vec2 center = (0.5 * place.xy + 0.5) * mesh_shadows.resolution - 0.5;
  float radius = max({{mesh_blur}} * mesh_shadows.resolution, 1.0);
  float bias = {{mesh_bias}} * (radius + 1.0) * slope.z;
  mat2 turn = mat2(cos({{golden_angle}}),
                   sin({{golden_angle}}),
                   -sin({{golden_angle}}),
                   cos({{golden_angle}}));
  vec2 direction = vec2(radius, 0.0);
  float lit_fraction = 0.0;
  for (int tap = 0; tap < {{mesh_taps}}; tap++) {
    vec2 scaled = center + mesh_shadows.shift + direction * sqrt((float(tap) + 0.5) / {{mesh_taps}}.0);
    vec2 low = floor(scaled), fraction = scaled - low;
    for (int corner = 0; corner < 4; corner++) {
      vec2 step_of = vec2(corner & 1, corner >> 1);
      vec2 texel = low + step_of;
      vec2 weights = mix(1.0 - fraction, fraction, step_of);
      float plane_depth = min(depth + dot(slope.xy, texel - center), 1.0) - bias;
      ivec2 clamped_texel = clamp(ivec2(texel), ivec2(0), ivec2(mesh_shadows.resolution) - 1);
      float first = texelFetch(mesh_depths, ivec3(clamped_texel, map), 0).x;
      lit_fraction += plane_depth <= first ? weights.x * weights.y : 0.0;
    }
    direction = turn * direction;
  }
  return lit_fraction / {{mesh_taps}}.0;
}
