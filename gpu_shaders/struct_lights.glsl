// The lights. Filled by pack_lights() of addon/shading/lights.py.
struct Lights {
  vec4 ambient_and_count;                    // xyz the world's radiance, w number of lights
  vec4 vector_and_kind[{{light_capacity}}];  // xyz direction to a sun, or a light's position; w kind:
                                             // sun 0, point 1, spot 2, rectangle 3, disk 4,
                                             // rectangle on a grid 5, ellipse on a grid 6
  vec4 power[{{light_capacity}}];            // xyz irradiance of a sun, flux of others; w term that a
                                             // radius adds to the squared distance, or the normalizer
                                             // of an area light's spread
  // xyz rows of the matrix into a spot's own axes; or an area light's right, up, and the direction
  // along which it shines. w:
  vec4 across[{{light_capacity}}];           // least squared distance, or half width
  vec4 upward[{{light_capacity}}];           // middle of a cone's rim in 1 - cos, or half height
  vec4 along[{{light_capacity}}];            // half width of that rim, or tangent of half a spread
  vec4 harmonics[{{harmonic_count}}];        // xyz the world's radiance in harmonics of orders 1 and 2
};
