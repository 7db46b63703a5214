// Opacity maps: how much light the hair lets through to a place.
//
// Twin of addon/shading/volume/opacity.py: same names, same order; a test holds the two together.
// References: Kim and Neumann 2001, "Opacity Shadow Maps"; Yuksel and Keyser 2008, "Deep Opacity
// Maps"; Nguyen and Donnelly 2005 for the look-up as a dot product.
// Needs the struct Opacity. Holds no resources.
//
//   light   start      ends[0]   ends[1]         ends[2]    depth
//   ------>   |-----------|---------|---------------|------->
//             0          sum 0     sum 1           sum 2      what the map holds at each end; in
//                                                             between tau is linear

// The layers whose sums a strand at this depth behind their start is part of: four of them.
vec4 adds_to(float depth, vec4 ends)
{
  return vec4(lessThanEqual(vec4(depth), ends));
}

// By what the sums are to be multiplied for tau at this depth: each layer's share in what is passed,
// less the next one's. `before` and `after` are the ends of the layers on both sides of these four.
vec4 layer_weights(float depth, vec4 ends, float before, float after)
{
  vec4 starts = vec4(before, ends.xyz);
  vec4 next = vec4(ends.yzw, after);
  vec4 passed = clamp((depth - starts) / (ends - starts), 0.0, 1.0);
  vec4 passed_next = clamp((depth - ends) / (next - ends), 0.0, 1.0);
  return passed - passed_next;
}

// Place in a light's map, xy in 0..1, and depth; outside of the map behind the light.
vec3 map_place(Opacity opacity, int light, vec3 point)
{
  vec4 at = vec4(point, 1.0);
  float w = dot(opacity.map_w[light], at);
  vec2 flat_place = vec2(dot(opacity.map_x[light], at), dot(opacity.map_y[light], at));
  vec2 place = w > 0.0 ? 0.5 * flat_place / w + 0.5 : vec2(-1.0);
  return vec3(place, dot(opacity.map_depth[light], at));
}

// Depth of the first hair in what was kept; 1 where there is none.
float start_depth(uint kept)
{
  return min(float(kept) / {{start_scale}}, 1.0);
}
