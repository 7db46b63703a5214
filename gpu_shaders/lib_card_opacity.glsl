// How much hair a card stands for in opacity maps.
//
// Twin of addon/shading/volume/card_opacity.py: what it means is written there. Holds no resources.

// tau that light meets in a card of thickness 1.
float card_optical_depth(float alpha)
{
  return -log(1.0 - min(alpha, {{max_alpha}}));
}

// |cos| of the turn about its strands by which a card faces a direction. `across`: normal of its plane, of
// any length.
float turned_facing(vec3 across, vec3 tangent, vec3 direction)
{
  vec3 turned = direction - dot(direction, tangent) * tangent;
  float size = length(across) * length(turned);
  return size > 0.0 ? abs(dot(across, turned)) / size : 1.0;
}

// The same of a layer that strands cross: how much denser it is as it was baked than from this direction.
// `tangent` may stand out of its plane.
float layer_facing(vec3 across, vec3 tangent, vec3 direction)
{
  vec3 front = across / max(length(across), 1.0e-30);
  float upright = dot(tangent, front), along = dot(tangent, direction);
  float baked = sqrt(1.0 - (1.0 - {{upright_shown}}) * upright * upright);
  return abs(dot(front, direction)) * baked / sqrt(max(1.0 - along * along, 1.0e-4));
}

// LAYERED: shells, else cards.
float hair_facing(vec3 across, vec3 tangent, vec3 direction)
{
#if defined(LAYERED) && LAYERED
  return layer_facing(across, tangent, direction);
#else
  return turned_facing(across, tangent, direction);
#endif
}

// Factor of the tau that light from this direction meets in a card of view-compensated alpha.
float view_compensated_depth(vec3 across, vec3 tangent, vec3 direction)
{
  return {{mean_turn}} / max(hair_facing(across, tangent, direction), {{min_facing}});
}

// How much hair lies before and beyond the strand that is seen of such a card; `plane`: before and beyond
// its plane by the map.
vec2 among_strands(vec2 plane, float scale, float tau, float fraction, float front)
{
  float few = max(tau, {{min_tau}});
  float others = scale * (few / (1.0 - exp(-few)) - 1.0);
  vec2 rest = max(plane - scale * tau * vec2(fraction, 1.0 - fraction), 0.0);
  return rest + others * vec2(1.0 - front, front);
}
