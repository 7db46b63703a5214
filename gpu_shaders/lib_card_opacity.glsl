// How much hair a card stands for in opacity maps.
//
// Twin of addon/shading/volume/card_opacity.py: what it means is written there. Holds no resources.

// tau that light meets in a card of thickness 1.
float card_optical_depth(float alpha)
{
  return -log(1.0 - min(alpha, {{most_alpha}}));
}
