// Where a strand's data lies in a texture.
//
// Twin of addon/render/strand_layout.py. Holds no resources.

// Where a strand's points lie: side by side in one row of each texture that has a texel a point.
struct StrandSpan {
  ivec2 first;  // texel of its root
  int count;    // of its points
  int factors;  // first texel of its detail factors, counted through
};

// Of equally many texels a strand, more than one: strand s is row s % {{strand_rows}} of a texture, in
// column block s / {{strand_rows}}.
ivec2 strand_texel(int strand, int cv, int cv_count)
{
  return ivec2((strand / {{strand_rows}}) * cv_count + cv, strand % {{strand_rows}});
}

// Of texels that are counted through, row by row, as of one texel a strand.
ivec2 counted_texel(int index)
{
  return ivec2(index % {{strand_rows}}, index / {{strand_rows}});
}

// Of points that differ in number from strand to strand; `spans` is the texture strand_spans.
StrandSpan strand_span(sampler2D spans, int strand)
{
  ivec4 span = ivec4(texelFetch(spans, counted_texel(strand), 0));
  return StrandSpan(span.xy, span.z, span.w);
}

ivec2 span_texel(StrandSpan span, int cv)
{
  return ivec2(span.first.x + cv, span.first.y);
}
