// A light on the screen and the grid of rays around it. Filled by addon/render/shafts_block.py.

struct Shafts {
  vec4 radiance;        // rgb of the haze at the light, w window depth of the light
  vec2 center;          // of the light [pixels]
  vec2 middle_cos_sin;  // direction of the middle ray
  float span;           // between the first and the last ray [rad]
  float nearest;        // where rays begin [pixels]
  float radial_step;    // between texels of a ray [pixels]
  float step_decay;           // fraction of a shaft that is left after a step
  float start_weight;         // weight of the path from the light to the begin of the rays
  float haze_decay;           // decay of the haze [1 / pixels]
  int angles;           // rays
  int is_round;         // whether the last ray is next to the first
};
