// Blend of a guide's segment between its style and its simulation.
//
// Twin of addon/dynamics/blend.py.

// fraction: 0 is the style, 1 the simulation. Where the two point in opposite directions, the simulation's
// is used.
vec3 blended_segment(vec3 simulated, vec3 style, float fraction)
{
  float simulated_length = length(simulated);
  float style_length = length(style);
  vec3 toward = simulated / max(simulated_length, 1.0e-12);
  vec3 ahead = style / max(style_length, 1.0e-12);
  vec3 direction = ahead + (toward - ahead) * fraction;
  float size = length(direction);
  direction = size > {{min_blend_direction}} ? direction / max(size, {{min_blend_direction}}) : toward;
  return direction * (style_length + (simulated_length - style_length) * fraction);
}
