// Strands as layers, third step: the nodes that are seen, one an invocation. What tells a node's
// colour gives way to the colour itself: yzw, as floats' bits, times its fraction of the pixel's light.
#include "lib_strand_geometry.glsl"
#include "lib_strand_light.glsl"
#include "lib_layer_packing.glsl"

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

vec3 layer_radiance(int strand, float along)
{
  int last = cv_count - 1;
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
  float radius = mix(root_side.w, tip_side.w, u) * strands.fullness *
                 mix(1.0, strands.tip_width, along);
  vec4 between = vec4(0.0), own = vec4(0.0);
#ifdef OTHER_TAU
  between = mix(texelFetch(cv_other_tau, strand_texel(strand, segment, cv_count), 0),
                texelFetch(cv_other_tau, strand_texel(strand, segment + 1, cv_count), 0),
                u);
#endif
#ifdef OWN_COLOR
  own = mix(texelFetch(cv_colors, strand_texel(strand, segment, cv_count), 0),
            texelFetch(cv_colors, strand_texel(strand, segment + 1, cv_count), 0),
            u);
#endif
  uint seed = uint(from_look.y);
  return strand_radiance(point, tangent, bend, radius, along, occlusion, between, own, seed);
}

void main()
{
  ivec2 place = ivec2(gl_GlobalInvocationID.xy);
  if (place.x + place.y * {{layer_row}} >= seen_count) {
    return;
  }
  ivec2 texel = layer_texel(imageLoad(layer_seen, place).x);
  uvec4 node = imageLoad(layer_nodes, texel);
  vec3 light = uintBitsToFloat(node.y) * layer_radiance(int(node.z), layer_along(node.w));
  imageStore(layer_nodes, texel, uvec4(node.x, floatBitsToUint(light)));
}
