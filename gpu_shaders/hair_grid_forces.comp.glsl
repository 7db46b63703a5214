// Hair among hair: applies friction to the motion of each CV, and stores pressure and cohesion for the
// substeps. One invocation per CV.
//
// Twin of friction_and_push in addon/dynamics/hair_grid.py.
#include "lib_strand_texel.glsl"
#include "lib_hair_grid.glsl"

// Twin of own_contribution: the CV's own part of the density (x), and its gradient (yzw).
vec4 own_contribution(vec3 fraction)
{
  vec3 far = min(fraction, 1.0 - fraction);
  vec3 along = 0.5 - 0.25 * far;
  vec3 slope = 0.5 * mix(far, -far, vec3(lessThan(fraction, vec3(0.5))));
  return vec4(along.x * along.y * along.z, slope * along.yxx * along.zzy);
}

void main()
{
  ivec2 id = ivec2(gl_GlobalInvocationID.xy);
  if (id.x >= CV_COUNT || id.y >= grid.counts.w) {
    return;
  }
  ivec2 texel = strand_texel(id.y, id.x, CV_COUNT);
  vec4 here = imageLoad(positions, texel);
  vec3 before = vec3(imageLoad(previous_positions, texel).xy, here.w);
  vec4 rest = texelFetch(hair_at_rest, texel, 0);
  HairGridCv cv = hair_grid_cv(grid, here.xyz, before);
  ivec3 counts = grid.counts.xyz;
  ivec3 low = wrapped_cell(cv.low, counts);
  ivec2 across = ivec2(low.x, cell_after(low.x, counts.x)) * counts.z;
  ivec2 up = ivec2(low.y, cell_after(low.y, counts.y));
  ivec2 deep = ivec2(low.z, cell_after(low.z, counts.z));
  vec4 found = vec4(0.0);
  vec3 gradient = vec3(0.0);
  for (int i = 0; i < 8; i++) {
    ivec3 corner = ivec3(i >> 2, (i >> 1) & 1, i & 1);
    ivec2 cell = ivec2(across[corner.x] + deep[corner.z], up[corner.y]);
    vec3 weights = mix(1.0 - cv.fraction, cv.fraction, vec3(corner));
    float weight = weights.x * weights.y * weights.z;
    found += texelFetch(densities, cell, 0) * weight;
    gradient += texelFetch(gradients, cell, 0).xyz * weight;
  }
  vec4 own = own_contribution(cv.fraction);
  found -= mass_and_motion(grid, cv.motion, rest.z) * own.x;
  gradient -= own.yzw * rest.z;
  float density = max(found.x, {{hair_grid_min_density}});
  float ratio = found.x / rest.y;
  float compression = clamp(ratio - (1.0 + {{hair_grid_density_tolerance}}), 0.0, 1.0);
  float expansion = clamp(rest.x / rest.y - ratio - {{hair_grid_density_tolerance}}, 0.0, 1.0);
  vec3 shift = gradient * ((expansion * grid.strength.y - compression * grid.strength.x) * rest.w / density);
  shift *= {{hair_grid_max_shift}} / max(length(shift), {{hair_grid_max_shift}});
  vec3 push = grid.to_cells_x.xyz * shift.x + grid.to_cells_y.xyz * shift.y + grid.to_cells_z.xyz * shift.z;
  float friction = 1.0 - exp(-grid.strength.z * (min(ratio, 1.0) + compression * {{hair_grid_pressed_friction}}) * rest.w);
  vec3 mean = found.yzw / (grid.units_per_metre * density);
  before += (cv.motion - mean) * (friction / grid.speed_ratio);
  imageStore(pushes, texel, vec4(push * grid.strength.w, 0.0));
  imageStore(positions, texel, vec4(here.xyz, before.z));
  imageStore(previous_positions, texel, vec4(before.xy, 0.0, 0.0));
}
