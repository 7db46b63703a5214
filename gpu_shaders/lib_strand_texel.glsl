// Layout of strand data in textures.
//
// Twin of addon/render/strand_layout.py. Holds no resources.

// The points of a strand: side by side in one row of each texture with a texel per point.
struct StrandSpan {
  ivec2 first;  // texel of its root
  int count;    // of its points
  int factors;  // index of the first texel of its detail factors, see counted_texel
};

// For the same number of texels per strand, more than one: strand s is in row s % {{strand_rows}} of the
// texture, in column block s / {{strand_rows}}.
ivec2 strand_texel(int strand, int cv, int cv_count)
{
  return ivec2((strand / {{strand_rows}}) * cv_count + cv, strand % {{strand_rows}});
}

// Texel of an index that counts row by row, such as that of a strand where each has one texel.
ivec2 counted_texel(int index)
{
  return ivec2(index % {{strand_rows}}, index / {{strand_rows}});
}

// For point counts that differ from strand to strand; `spans` is the texture strand_spans.
StrandSpan strand_span(sampler2D spans, int strand)
{
  ivec4 span = ivec4(texelFetch(spans, counted_texel(strand), 0));
  return StrandSpan(span.xy, span.z, span.w);
}

ivec2 span_texel(StrandSpan span, int cv)
{
  return ivec2(span.first.x + cv, span.first.y);
}
