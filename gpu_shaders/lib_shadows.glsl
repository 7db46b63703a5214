// Shadows of hair and meshes. SHADOWS: there are opacity maps. MESH_SHADOWS: there are shadow maps of all
// meshes.
#if SHADOWS
#  include "lib_opacity_look_up.glsl"
#endif
#ifdef MESH_SHADOWS
#  include "lib_mesh_shadows.glsl"
#endif

// x number of strands between a light and a point, -1 where the light has no map, y number of strands
// behind the point, z the fraction of the light that no mesh blocks.
vec3 shadow_path(int index, vec3 point)
{
#if SHADOWS
  if (opacity.light[index].x >= 0.0) {
    return light_path(index, point) * vec3(opacity.extinction, opacity.extinction, 1.0);
  }
#endif
  return vec3(-1.0, {{default_tau_beyond}}, 1.0);
}

#if SHADOWS && defined(MESH_SHADOWS)
// Whether the hair's map has smaller texels at a point than the map of all meshes.
bool map_is_finer(int index, vec3 point)
{
  int map = mesh_map_at(index, point);
  if (map < 0) {
    return true;
  }
  float w = dot(opacity.map_w[index], vec4(point, 1.0)), mesh_w = mesh_map_place(map, point).z;
  float hair = length(opacity.map_x[index].xyz) * float(textureSize(opacity_meshes, 0).x);
  float mesh = length(mesh_shadows.map_x[map].xyz) * mesh_shadows.resolution;
  return hair * mesh_w > mesh * w;
}
#endif

// The fraction of a light that no mesh blocks, at a place of a mesh. path: of shadow_path. normal: of its
// triangle. Meshes may extend beyond the hair's map, where their shadows would end at a line. So towards the
// map's border, and wherever the map of all meshes is finer, that map replaces it; without one, shadows fade.
float light_past_meshes(int index, vec3 point, vec3 normal, vec3 path)
{
  float within = 0.0;
#if SHADOWS
  if (path.x >= 0.0) {
    vec3 place = map_place(opacity, index, point);
    within = mesh_shadow_weight(place.xy);
#  ifdef MESH_SHADOWS
    // the hair's map clamps depths before and behind all hair
    within = min(within, mesh_shadow_weight(vec2(0.5, depth_before_meshes(opacity, place.z))));
    within = map_is_finer(index, point) ? within : 0.0;
#  endif
  }
#endif
  float beyond = 1.0;
#ifdef MESH_SHADOWS
  if (within < 1.0) {
    beyond = mesh_light(index, point, normal);
  }
#endif
  return mix(beyond, path.z, within);
}

// As shadow_path, for a place of a mesh and the normal of its triangle.
vec3 shadow_path_to_mesh(int index, vec3 point, vec3 normal)
{
  vec3 path = shadow_path(index, point);
  return vec3(path.xy, light_past_meshes(index, point, normal, path));
}

// The fraction of a light that hair and meshes let through, by colour. forward: fraction of the light on a
// strand that it scatters forward.
vec3 transmitted_light(vec3 path, vec3 forward)
{
  return path.z * exp(-max(path.x, 0.0) * (1.0 - forward));
}

#if SHADOWS
// Fraction of a strand or card at a point that counts towards tau at another point, since tau grows linearly
// through the layer in which it lies. Twin of self_fraction in addon/shading/volume/opacity.py.
float self_fraction(int light, vec3 point, vec3 target)
{
  vec3 place = map_place(opacity, light, point);
  float depth = min(place.z, 1.0);
  float bias = opacity.bias + place.z - map_place(opacity, light, target).z;
#  if DEEP
  ivec2 texel_at = clamp(ivec2(place.xy * float(opacity.resolution)), 0, opacity.resolution - 1);
  LayerSpan span = layer_span(
      opacity_spans, texel_at, int(opacity.light[light].x), opacity.resolution);
  vec2 layers = layers_at(span, place.xy * float(opacity.resolution));
  depth = min((depth - layers.x) * layers.y, 1.0);
  bias *= layers.y;
#  endif
  float before = 0.0;
  for (int texel = 0; texel < opacity.layer_texels; texel++) {
    for (int lane = 0; lane < 4; lane++) {
      float end = opacity.ends[texel][lane];
      if (depth <= end) {
        return clamp((depth - bias - before) / (end - before), 0.0, 1.0);
      }
      before = end;
    }
  }
  return 0.0;
}
#endif

// As shadow_path, for a place of a strand of this radius [m] and opacity. The maps contain the strand
// itself, whose part is subtracted on both sides of the place.
vec3 shadow_path_to_strand(int index, vec3 point, vec3 tangent, float radius, float strand_opacity)
{
  vec3 path = shadow_path(index, point);
#if SHADOWS
  if (path.x >= 0.0) {
    float strand_tau = opacity.extinction * strand_opacity *
                       self_tau_at(opacity, index, point, tangent, radius);
    float fraction = self_fraction(index, point, point);
    path.xy = max(path.xy - strand_tau * vec2(fraction, 1.0 - fraction), 0.0);
  }
#endif
  return path;
}
