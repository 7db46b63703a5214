// Coverage of a pixel by a thin strip: the pixel is a unit square, the strip is infinitely long.
//
// Twin of addon/shading/volume/transparency.py. Holds no resources.

// The fraction of a pixel that lies below a line, whose distance from the pixel's centre is `distance`,
// positive above it. `normal` is the line's unit normal without its signs.
float fraction_below(float distance, vec2 normal)
{
  float wide = max(normal.x, normal.y), narrow = min(normal.x, normal.y);
  float inner = 0.5 * (wide - narrow), reach = 0.5 * (wide + narrow);
  float away = min(abs(distance), reach);
  float corner = (reach - away) * (reach - away) / (2.0 * wide * max(narrow, 1.0e-6));
  float beyond = away <= inner ? 0.5 - away / wide : corner;
  return distance < 0.0 ? beyond : 1.0 - beyond;
}

// The fraction that a strip covers. half_width: of the strip [pixels]; distance: of its middle line from
// the pixel's centre [pixels].
float strip_coverage(float distance, float half_width, vec2 normal)
{
  return fraction_below(distance + half_width, normal) - fraction_below(distance - half_width, normal);
}

// Greatest distance from a strip's edge to the centre of a pixel that it partly covers [pixels].
float coverage_reach(vec2 normal)
{
  return 0.5 * (abs(normal.x) + abs(normal.y));
}

// The fraction of a pixel that a ribbon covers. ribbon_of: x distance from its middle line, y half its
// width, zw its normal, all linear in screen space. The vertex stage multiplies them by clip w and the
// fragment stage by gl_FragCoord.w, because some drivers clip noperspective varyings wrongly.
float ribbon_coverage(vec4 ribbon_of)
{
  return strip_coverage(ribbon_of.x, ribbon_of.y, abs(ribbon_of.zw));
}
