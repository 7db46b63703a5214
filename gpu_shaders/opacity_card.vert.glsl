// Opacity maps, vertex stage of cards: their triangles in the light's view.
#include "lib_opacity.glsl"

void main()
{
  vec4 world = vec4(position, 1.0);
  float w = dot(opacity.map_w[light_index], world);
  float depth = clamp(dot(opacity.map_depth[light_index], world), 0.0, 1.0);
  card_uv = uv;
  card_point = position;
  card_tangent = tangent;
  // the direction along which the place in the map is constant
  vec2 here = vec2(dot(opacity.map_x[light_index], world), dot(opacity.map_y[light_index], world)) / w;
  light_direction = cross(opacity.map_x[light_index].xyz - here.x * opacity.map_w[light_index].xyz,
                    opacity.map_y[light_index].xyz - here.y * opacity.map_w[light_index].xyz);
  strand_depth = depth;
  gl_Position = vec4(dot(opacity.map_x[light_index], world), dot(opacity.map_y[light_index], world),
                     (2.0 * depth - 1.0) * w, w);
}
