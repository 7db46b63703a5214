// Strands as layers, second step: of each pixel's list the nearest LAYERS in order, shaded while
// enough light comes from behind them. What lies deeper covers as much as it does, in the mean colour
// of those.
//
// Twin of over_nearest in addon/shading/volume/transparency.py.
#include "lib_strand_geometry.glsl"
#include "lib_strand_light.glsl"
#include "lib_layer_packing.glsl"
#include "lib_output.glsl"

struct Layer {
  uint depth, strand, word;
};

// Nearest first. Depths of equal layers are floats' bits, which order as the floats do above 0. Where
// two are equal, what belongs to the strands decides, not when they were drawn.
bool is_before(Layer one, Layer other)
{
  return one.depth != other.depth ? one.depth < other.depth :
         one.word != other.word   ? one.word < other.word :
                                    one.strand < other.strand;
}

// How much the tangent turns in a pixel, at a place of a segment.
vec3 tangent_bend(vec3 before, vec3 from, vec3 to, vec3 after, float u, vec3 tangent)
{
  vec4 clip = view.view_projection * vec4(catmull_rom_point(before, from, to, after, u), 1.0);
  vec4 moved = view.view_projection * vec4(tangent, 0.0);
  vec2 slope = (moved.xy * clip.w - clip.xy * moved.w) * 0.5 * view.viewport.xy;
  float metres = clip.w * clip.w / max(length(slope), 1.0e-20);
  float segments = min(metres / max(distance(from, to), 1.0e-20), 1.0e3);
  float ahead = clamp(segments, 1.0e-3, 1.0);
  vec3 turned = catmull_rom_tangent(before, from, to, after, u + ahead) - tangent;
  return turned * segments / ahead;
}

vec3 layer_radiance(Layer layer)
{
  int strand = int(layer.strand), last = cv_count - 1;
  float along = layer_along(layer.word);
  int segment = min(int(along * float(last)), last - 1);
  float u = along * float(last) - float(segment);
  vec4 root_side = texelFetch(cv_points, strand_texel(strand, segment, cv_count), 0);
  vec4 tip_side = texelFetch(cv_points, strand_texel(strand, segment + 1, cv_count), 0);
  vec3 from = root_side.xyz, to = tip_side.xyz;
  vec3 before = texelFetch(cv_points, strand_texel(strand, max(segment - 1, 0), cv_count), 0).xyz;
  vec3 after = texelFetch(cv_points, strand_texel(strand, min(segment + 2, last), cv_count), 0).xyz;
  before = segment == 0 ? 2.0 * from - to : before;
  after = segment == last - 1 ? 2.0 * to - from : after;
  vec2 from_look = texelFetch(cv_looks, strand_texel(strand, segment, cv_count), 0).xy;
  vec2 to_look = texelFetch(cv_looks, strand_texel(strand, segment + 1, cv_count), 0).xy;
  vec3 point = catmull_rom_point(before, from, to, after, u);
  vec3 tangent = catmull_rom_tangent(before, from, to, after, u);
  vec3 bend = vec3(0.0);
#if MARSCHNER
  bend = tangent_bend(before, from, to, after, u, tangent);
#endif
  float occlusion = mix(from_look.x, to_look.x, u);
  float radius = mix(root_side.w, tip_side.w, u) * strands.width_scale *
                 mix(1.0, strands.tip_width, along);
  return strand_radiance(point, tangent, bend, radius, along, occlusion, uint(from_look.y));
}

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, imageSize(layer_heads)))) {
    return;
  }
  Layer nearest[LAYERS];
  for (int i = 0; i < LAYERS; i++) {
    nearest[i] = Layer(0xFFFFFFFFu, 0u, 0u);
  }
  float behind_all = 1.0;
  uint number = imageLoad(layer_heads, pixel).x;
  while (number != 0u) {
    uvec4 node = imageLoad(layer_nodes, layer_texel(number));
    Layer found = Layer(node.y, node.z, node.w);
    behind_all *= 1.0 - layer_alpha(node.w);
    for (int i = 0; i < LAYERS; i++) {
      Layer kept = nearest[i];
      bool is_nearer = is_before(found, kept);
      nearest[i].depth = is_nearer ? found.depth : kept.depth;
      nearest[i].strand = is_nearer ? found.strand : kept.strand;
      nearest[i].word = is_nearer ? found.word : kept.word;
      found.depth = is_nearer ? kept.depth : found.depth;
      found.strand = is_nearer ? kept.strand : found.strand;
      found.word = is_nearer ? kept.word : found.word;
    }
    number = node.x;
  }

  vec3 light = vec3(0.0);
  float through = 1.0, front = 2.0;
  for (int i = 0; i < LAYERS; i++) {
    bool is_seen = i == 0 || through - behind_all >= {{unseen_share}};
    if (nearest[i].depth == 0xFFFFFFFFu || !is_seen) {
      break;
    }
    float alpha = layer_alpha(nearest[i].word);
    light += through * alpha * layer_radiance(nearest[i]);
    through *= 1.0 - alpha;
    front = front > 1.0 && through <= 0.5 ? uintBitsToFloat(nearest[i].depth) : front;
  }
  float alpha = 1.0 - behind_all;
  light *= alpha / max(1.0 - through, 1.0e-6);
  vec3 shown = output_encoded(light / max(alpha, 1.0e-6), output_encoding);
  imageStore(layer_colors, pixel, vec4(shown * alpha, alpha));
  imageStore(layer_fronts, pixel, vec4(front));
}
