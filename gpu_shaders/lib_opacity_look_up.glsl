// Look-up in opacity maps: the optical depth between a light and a place, and beyond the place.
//
// Twin of look_up in addon/shading/volume/opacity.py. Reads the block `opacity`, the texture arrays
// `opacity_0` to `opacity_{SLOTS - 1}`, `opacity_meshes`, and `opacity_spans` where layers are DEEP. Where
// they are not, one filtered look-up covers the four texels around a place, and tau is taken up to the
// nearest of their meshes; the twin takes it up to each texel's own mesh.
//
// Texel t of a map lies in array t % SLOTS, since a framebuffer cannot hold several layers of one
// array, in one of PASSES layers of it.
#include "lib_opacity.glsl"

#if DEEP
#  define OPACITY_SUMS(array, layer) texelFetch(array, ivec3(texel, layer), 0)
#else
#  define OPACITY_SUMS(array, layer) texture(array, vec3(place, float(layer)))
#endif

#define OPACITY_ADD(slot, array) \
  { \
    vec4 ends = opacity.ends[pass * SLOTS + slot], sums = OPACITY_SUMS(array, layer); \
    vec4 within = sums - vec4(sum_before, sums.xyz); \
    tau.x += dot(within, layers_passed(depths.x, ends, before)); \
    tau.y += dot(within, layers_passed(depths.y, ends, before)); \
    before = ends.w; \
    sum_before = sums.w; \
  }

// tau at two depths behind the start of the layers: of one texel, or, where all layers start at the same
// depth, of its bilinear neighbourhood.
vec2 summed_layers(int map, vec2 place, ivec2 texel, vec2 depths)
{
  vec2 tau = vec2(0.0);
  float before = 0.0, sum_before = 0.0;
  for (int pass = 0; pass < PASSES; pass++) {
    int layer = map * PASSES + pass;
    OPACITY_ADD(0, opacity_0)
#if SLOTS > 1
    OPACITY_ADD(1, opacity_1)
#endif
#if SLOTS > 2
    OPACITY_ADD(2, opacity_2)
#endif
#if SLOTS > 3
    OPACITY_ADD(3, opacity_3)
#endif
#if SLOTS > 4
    OPACITY_ADD(4, opacity_4)
#endif
#if SLOTS > 5
    OPACITY_ADD(5, opacity_5)
#endif
  }
  return tau;
}

// x the fraction of the light that no mesh blocks, y the depth of the nearest mesh around a place. The mesh
// maps have their own resolution, since maps of strands that represent many hairs are coarser.
vec2 mesh_path(int map, vec2 place, float depth)
{
  int side = textureSize(opacity_meshes, 0).x;
  vec2 scaled = place * float(side) - 0.5;
  vec2 fraction = scaled - floor(scaled);
  ivec2 low = ivec2(floor(scaled));
  vec2 found = vec2(0.0, 1.0);
  for (int corner = 0; corner < 4; corner++) {
    ivec2 step_of = ivec2(corner & 1, corner >> 1);
    ivec2 texel = clamp(low + step_of, ivec2(0), ivec2(side - 1));
    vec2 weights = mix(1.0 - fraction, fraction, vec2(step_of));
    float mesh = texelFetch(opacity_meshes, ivec3(texel, map), 0).x;
    found.x += depth <= mesh ? weights.x * weights.y : 0.0;
    found.y = min(found.y, mesh);
  }
  return found;
}

// x tau between the light and a place, y tau from there to the first mesh, z the fraction of the light
// that no mesh blocks.
vec3 light_path(int light, vec3 point)
{
  int map = int(opacity.light[light].x);
  vec3 place = map_place(opacity, light, point);
  if (map < 0 || any(lessThan(place.xy, vec2(0.0))) || any(greaterThan(place.xy, vec2(1.0)))) {
    return vec3(0.0, 0.0, 1.0);
  }
  float depth = min(place.z, 1.0) - opacity.bias;
  vec2 meshes = mesh_path(map, place.xy, depth_before_meshes(opacity, min(place.z, 1.0)));
  vec2 tau = vec2(0.0);
#if DEEP
  vec2 scaled = place.xy * float(opacity.resolution) - 0.5;
  vec2 fraction = scaled - floor(scaled);
  ivec2 low = ivec2(floor(scaled));
  int mesh_side = textureSize(opacity_meshes, 0).x;
  for (int corner = 0; corner < 4; corner++) {
    ivec2 step_of = ivec2(corner & 1, corner >> 1);
    ivec2 texel = clamp(low + step_of, ivec2(0), ivec2(opacity.resolution - 1));
    vec2 weights = mix(1.0 - fraction, fraction, vec2(step_of));
    float weight = weights.x * weights.y;
    ivec2 middle = (2 * texel + 1) * mesh_side / (2 * opacity.resolution);
    float mesh = texelFetch(opacity_meshes, ivec3(middle, map), 0).x;
    // layers start at different depths in each texel, so tau is computed per texel and then blended
    LayerSpan span = layer_span(opacity_spans, texel, map, opacity.resolution);
    vec2 depths = vec2(layer_fraction(span, scaled + 0.5, depth),
                       layer_fraction(span, vec2(texel) + 0.5, mesh));
    tau += weight * summed_layers(map, place.xy, texel, depths);
  }
#else
  tau = summed_layers(map, place.xy, ivec2(0), vec2(depth, meshes.y));
#endif
  return vec3(tau.x, max(tau.y - tau.x, 0.0), meshes.x);
}
