// Where a strand's data lies in a texture.
//
// Twin of strand_rows in addon/render/textures.py. Holds no resources.

// Strand s is row s % {{strand_rows}} of a texture, in column block s / {{strand_rows}}.
ivec2 strand_texel(int strand, int cv, int cv_count)
{
  return ivec2((strand / {{strand_rows}}) * cv_count + cv, strand % {{strand_rows}});
}
