// Marschner's fibre beyond its tables. Filled by pack_fibre() of addon/shading/marschner/look.py.
struct Fibre {
  vec4 root;       // xyz absorption per radius; w factor by which a root of absorption is a colour
  vec4 tip;        // the same of the tip's own colour; w fraction of absorption that a grey strand has
  vec4 strengths;  // of R, TT, TRT and the rest
  vec4 widths;     // of the same, of theta_h [rad]
  vec4 shifts;     // of their highlights to the tip, in theta_h [rad]
};
