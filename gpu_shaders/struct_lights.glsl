// The lights. Filled by pack_lights() of addon/shading/lights.py.
struct Lights {
  vec4 ambient_and_count;                    // xyz the world's radiance, w number of lights
  vec4 vector_and_kind[{{light_capacity}}];  // xyz towards a sun (w 0), or a point's place (w 1)
  vec4 power[{{light_capacity}}];            // xyz irradiance of a sun, flux of a point
};
