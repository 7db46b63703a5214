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

// How far behind the front of a card's strands lies the one that is seen, as a fraction of their depth.
float seen_depth(float seen)
{
  float few = clamp(seen, {{min_seen}}, {{max_seen}});
  return 1.0 / few - 1.0 / (exp(few) - 1.0);
}

// tau of the other strands of a card before the one that is seen, and beyond it.
vec2 own_strands(float seen, float own, float near, float front)
{
  float a = clamp(seen, {{min_seen}}, {{max_seen}}), b = clamp(own, 0.0, {{max_seen}});
  b = abs(b - a) < {{apart}} * a ? (1.0 + {{apart}}) * a : b;
  near = min(near, 1.0);
  float left = 1.0 - near;
  float before = exp(-a * near), behind = exp(-a * left), end = exp(-a);
  float ahead = 1.0 - before + a / (a + b) * (before - end * exp(-b * left));
  float back = a / (a - b) * (exp(-b * left) - behind) + behind - end;
  float met = max(-log(mix(back, ahead, front) / (1.0 - end)), 0.0);
  return vec2(met, max(own - met, 0.0));
}

// The same of short hair, of which one sees a tip beside others. tau: of the card, of which light meets
// `own`.
vec2 own_tips(float own, float tau, float front)
{
  float few = max(tau, {{min_seen}});
  return own * (1.0 / (1.0 - exp(-few)) - 1.0 / few) * vec2(1.0 - front, front);
}
