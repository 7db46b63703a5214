// Uniform block of a frame of dynamics, filled by addon/render/dynamics_block.py. CV_COUNT is a
// define of the recipe.
struct Dynamics {
  int guide_count;
  int substep_count;
  int collider_count;
  int contact_passes;
  int length_iterations;
  int relaxations;
  int long_range;
  float length_tolerance;
  float dt;           // [s]
  float kept;         // fraction of the speed that damping leaves
  float air_fraction;    // fraction of the air's speed that damping gives
  float drag;         // [1/m]
  float friction;
  float led_out;      // [m] in a substep
  float speed_ratio;  // of this substep to the one before the frame
  float reach;        // [m] from its plane in which a CV gets a contact
  vec4 fall;          // xyz [m] that gravity adds in a substep; w duration of the frame before, over
                      // that of this one
  vec4 combed;        // xyz the same of the gravity in which the style was combed, where it is held
  vec4 wind;          // xyz mean [m/s]; w factor of force fields
  vec4 springs;       // x fraction of their room that curls give, y 1 / (kappa dt^2), see lib_springs.glsl;
                      // z [m] that lengths cannot be kept better than; w [m] that force fields move a CV at most
  vec4 swing[{{wind_modes}}];  // xyz [m/s]
  vec4 wave[{{wind_modes}}];   // xyz [1/m]
  vec4 band[CV_COUNT];  // of each CV: near and far factor, inverse pivot, pull
  vec4 own[CV_COUNT];   // of each CV: bend, collision radius [m]
};
