// Marschner's fibre, except for its tables. Filled by pack_fibre() of addon/shading/marschner/look.py.
struct Fibre {
  vec4 root;       // xyz absorption per radius; w -log(colour) over the square root of absorption
  vec4 tip;        // xyz the same of the tips' colour; w fraction of absorption that a grey strand has
  vec4 strengths;  // of R, TT, TRT and the rest
  vec4 widths;     // of the same lobes, in theta_h [rad]
  vec4 shifts;     // of their highlights towards the tip, in theta_h [rad]
};
