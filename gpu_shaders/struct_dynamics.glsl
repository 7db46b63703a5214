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
  float dt;                  // [s]
  float velocity_factor;     // fraction of the speed that damping leaves
  float air_factor;          // fraction of the air's speed that damping adds
  float drag;                // [1/m]
  float friction;
  float max_exit;            // [m] in a substep
  float speed_ratio;         // length of the first substep over that of the one before it
  float contact_margin;      // [m] distance beyond its radius within which a CV gets a contact
  vec4 gravity;              // xyz [m] displacement by gravity in a substep; w duration of the frame before,
                             // over that of this one
  vec4 compensated_gravity;  // xyz the same for the gravity that the style compensates
  vec4 wind;                 // xyz mean [m/s]; w factor of force fields
  vec4 springs;              // x fraction of their slack by which curls extend, y 1 / (kappa dt^2), see
                             // lib_springs.glsl; z [m] rounding error of lengths; w [m] largest displacement
                             // by force fields
  vec4 gust_amplitude[{{wind_modes}}];    // xyz [m/s]
  vec4 gust_wave_vector[{{wind_modes}}];  // xyz [1/m]
  vec4 band[CV_COUNT];                  // for each CV: near and far factor, inverse pivot, global stiffness
  vec4 stiffness_and_radius[CV_COUNT];  // for each CV: local stiffness, collision radius [m]
};
