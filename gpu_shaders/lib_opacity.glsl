// Opacity maps: how much light hair lets through to a place.
//
// Twin of addon/shading/volume/opacity.py: same names, same order; a test compares the two.
// References: Kim and Neumann 2001, "Opacity Shadow Maps"; Yuksel and Keyser 2008, "Deep Opacity
// Maps"; Nguyen and Donnelly 2005 for the look-up as a dot product.
// Needs the struct Opacity. Holds no resources.
//
//   light   start      ends[0]   ends[1]         ends[2]    depth
//   ------>   |-----------|---------|---------------|------->
//             0          sum 0     sum 1           sum 2      tau that the map holds at each end;
//                                                             in between it is interpolated
// Depth is measured from the start of a texel's layers, as a fraction of their total thickness.

// Which of four layers' sums a strand at this depth behind their start adds to, 1 or 0 each.
vec4 layers_including(float depth, vec4 ends)
{
  return vec4(lessThanEqual(vec4(depth), ends));
}

// The fraction of each of four layers that lies in front of this depth. `before` is the end of the
// preceding layer.
vec4 layers_passed(float depth, vec4 ends, float before)
{
  vec4 starts = vec4(before, ends.xyz);
  return clamp((depth - starts) / (ends - starts), 0.0, 1.0);
}

// Place in a light's map: xy in 0..1, outside of the map behind the light; z depth.
vec3 map_place(Opacity opacity, int light, vec3 point)
{
  vec4 world = vec4(point, 1.0);
  float w = dot(opacity.map_w[light], world);
  vec2 flat_place = vec2(dot(opacity.map_x[light], world), dot(opacity.map_y[light], world));
  vec2 place = w > 0.0 ? 0.5 * flat_place / w + 0.5 : vec2(-1.0);
  return vec3(place, dot(opacity.map_depth[light], world));
}

// Weight of the map's mesh shadows on meshes, which may extend beyond the map: 1 in its middle, 0 at its
// border.
float mesh_shadow_weight(vec2 place)
{
  vec2 away = abs(place - 0.5);
  return clamp((0.5 - max(away.x, away.y)) / {{map_border}}, 0.0, 1.0);
}

// A depth with the bias subtracted, for comparison with the depths of meshes.
float depth_before_meshes(Opacity opacity, float depth)
{
  return depth - max(opacity.bias, {{min_mesh_bias}});
}

// Texels per metre across a strand in a light's map. `across` is the unit vector across the strand in the
// map, xyw its place before the division by w.
float strand_breadth(Opacity opacity, int light, vec3 xyw, vec2 across)
{
  // gradients of the place, times 2 w
  float w = max(abs(xyw.z), 1.0e-6);
  vec3 turn_x = opacity.map_x[light].xyz - xyw.x / w * opacity.map_w[light].xyz;
  vec3 turn_y = opacity.map_y[light].xyz - xyw.y / w * opacity.map_w[light].xyz;
  return length(across.x * turn_x + across.y * turn_y) * 0.5 * float(opacity.resolution) / w;
}

// The strand's own part of the tau that a map holds at its middle line. half_width: in texels.
float self_tau(float half_width)
{
  float drawn_half_width = max(half_width, 0.5);
  float blocked = min(drawn_half_width, 1.0);
  return half_width / drawn_half_width * blocked * (2.0 - blocked);
}

// The same for a strand of this radius [m].
float self_tau_at(Opacity opacity, int light, vec3 point, vec3 tangent, float radius)
{
  vec4 world = vec4(point, 1.0);
  vec3 xyw = vec3(
      dot(opacity.map_x[light], world), dot(opacity.map_y[light], world), dot(opacity.map_w[light], world));
  vec3 change = vec3(dot(opacity.map_x[light].xyz, tangent),
                     dot(opacity.map_y[light].xyz, tangent),
                     dot(opacity.map_w[light].xyz, tangent));
  vec2 along = change.xy * xyw.z - xyw.xy * change.z;
  float size = length(along);
  vec2 across = size > 1.0e-20 ? vec2(-along.y, along.x) / size : vec2(1.0, 0.0);
  return self_tau(radius * strand_breadth(opacity, light, xyw, across));
}

// Depth of the first hair from a texel of `starts`; 1 where there is none.
float start_depth(uint stored)
{
  return min(float(stored) / {{start_scale}}, 1.0);
}

// Start and total thickness of deep layers, as planes over a block of texels: x the value in its middle,
// yz the change per texel.
struct LayerSpan {
  vec2 middle;
  vec3 start;
  vec3 thickness;
};

LayerSpan layer_span(sampler2D spans, ivec2 texel, int map, int resolution)
{
  int side = resolution / {{start_texels}};
  ivec2 block = texel / {{start_texels}}, stored_texel = block + ivec2(0, map * side);
  return LayerSpan((vec2(block) + 0.5) * float({{start_texels}}),
                   texelFetch(spans, stored_texel, 0).xyz,
                   texelFetch(spans, stored_texel + ivec2(side, 0), 0).xyz);
}

// x start of the layers at a place [texels], y one over their total thickness.
vec2 layers_at(LayerSpan span, vec2 place)
{
  vec3 weights = vec3(1.0, place - span.middle);
  return vec2(dot(span.start, weights),
              1.0 / max(dot(span.thickness, weights), {{min_thickness}}));
}

// A depth at a place [texels], as a fraction of the layers.
float layer_fraction(LayerSpan span, vec2 place, float depth)
{
  vec2 layers = layers_at(span, place);
  return (depth - layers.x) * layers.y;
}
