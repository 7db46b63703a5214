// Optical depth of hair cards in opacity maps.
//
// Twin of addon/shading/volume/card_opacity.py, which explains the model. Holds no resources.

// tau of a card of thickness 1.
float card_optical_depth(float alpha)
{
  return -log(1.0 - min(alpha, {{max_alpha}}));
}

// |cos| of the angle, measured about the card's strands, between the card's normal and a direction.
// `across`: normal of its plane, of any length.
float turned_facing(vec3 across, vec3 tangent, vec3 direction)
{
  vec3 turned = direction - dot(direction, tangent) * tangent;
  float size = length(across) * length(turned);
  return size > 0.0 ? abs(dot(across, turned)) / size : 1.0;
}

// The same for a layer of shells, which strands cross: its density as baked over that seen from this
// direction. `tangent` may stick out of its plane.
float layer_facing(vec3 across, vec3 tangent, vec3 direction)
{
  vec3 front = across / max(length(across), 1.0e-30);
  float upright = dot(tangent, front), along = dot(tangent, direction);
  float baked = sqrt(1.0 - (1.0 - {{visible_upright}}) * upright * upright);
  return abs(dot(front, direction)) * baked / sqrt(max(1.0 - along * along, 1.0e-4));
}

// LAYERED: 1 for shells, else cards.
float hair_facing(vec3 across, vec3 tangent, vec3 direction)
{
#if defined(LAYERED) && LAYERED
  return layer_facing(across, tangent, direction);
#else
  return turned_facing(across, tangent, direction);
#endif
}

// Factor on tau of a card with view-compensated alpha, for light from this direction.
float view_compensated_depth(vec3 across, vec3 tangent, vec3 direction)
{
  return {{mean_turn}} / max(hair_facing(across, tangent, direction), {{min_facing}});
}

// Mean depth of the visible strand behind the front of a card's strands, as a fraction of their depth.
// eye_tau: tau of the card along the eye's ray.
float visible_depth(float eye_tau)
{
  float clamped = clamp(eye_tau, {{min_eye_tau}}, {{max_eye_tau}});
  return 1.0 / clamped - 1.0 / (exp(clamped) - 1.0);
}

// tau of a card's other strands: x between the light and the visible strand, y beyond it. eye_tau, light_tau:
// tau of the card along the eye's and the light's ray. near: distance from the visible strand within which
// they do not count, as a fraction of their depth. front: 1 for light from the eye's side of the card, 0 from
// behind.
vec2 tau_within_card(float eye_tau, float light_tau, float near, float front)
{
  float a = clamp(eye_tau, {{min_eye_tau}}, {{max_eye_tau}}), b = clamp(light_tau, 0.0, {{max_eye_tau}});
  b = abs(b - a) < {{min_tau_difference}} * a ? (1.0 + {{min_tau_difference}}) * a : b;
  near = min(near, 1.0);
  float remaining = 1.0 - near;
  float before = exp(-a * near), behind = exp(-a * remaining), end = exp(-a);
  float ahead = 1.0 - before + a / (a + b) * (before - end * exp(-b * remaining));
  float back = a / (a - b) * (exp(-b * remaining) - behind) + behind - end;
  float tau_before = max(-log(mix(back, ahead, front) / (1.0 - end)), 0.0);
  return vec2(tau_before, max(light_tau - tau_before, 0.0));
}

// tau_within_card for a strand that lies deeper than visible strands on average, by this fraction of their
// depth.
vec2 tau_within_card_at_depth(vec2 strands, float deeper, float front)
{
  float light_tau = strands.x + strands.y;
  float tau_before = clamp(strands.x + light_tau * deeper * (2.0 * front - 1.0), 0.0, light_tau);
  return vec2(tau_before, light_tau - tau_before);
}

// As tau_within_card for short hair, where one sees a tip beside others. card_tau: of the card; light_tau:
// what light meets of it.
vec2 tau_within_short_hair(float light_tau, float card_tau, float front)
{
  float clamped = max(card_tau, {{min_eye_tau}});
  return light_tau * (1.0 / (1.0 - exp(-clamped)) - 1.0 / clamped) * vec2(1.0 - front, front);
}
