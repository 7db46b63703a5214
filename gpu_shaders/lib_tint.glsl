// Tint of strands towards the tips' colour, for both shading models.
//
// Twin of addon/shading/tint.py. Needs the struct ShadingSettings. Holds no resources.

// MIN_SPAN of addon/shading/tint.py
const float MIN_TINT_SPAN = 1.0e-4;

// Fraction of the tips' colour at a place; `along` is 0 at the root and 1 at the tip.
float tip_fraction(float along, ShadingSettings shading)
{
  float span = max(shading.tint_end - shading.tint_start, MIN_TINT_SPAN);
  float rise = clamp((along - shading.tint_start) / span, 0.0, 1.0);
  return shading.tip_tint * rise * rise * (3.0 - 2.0 * rise);
}
