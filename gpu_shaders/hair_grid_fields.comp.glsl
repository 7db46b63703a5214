// Hair among hair: smoothed sums of the cells, and the gradient of density. One invocation per cell.
//
// Twin of _fields in addon/dynamics/hair_grid.py.
#include "lib_hair_grid.glsl"

void main()
{
  ivec3 counts = grid.counts.xyz;
  ivec2 id = ivec2(gl_GlobalInvocationID.xy);
  if (id.x >= counts.x * counts.z || id.y >= counts.y) {
    return;
  }
  ivec3 cell = ivec3(id.x / counts.z, id.y, id.x % counts.z);
  ivec3 before = ivec3(cell_before(cell.x, counts.x), cell_before(cell.y, counts.y), cell_before(cell.z, counts.z));
  ivec3 after = ivec3(cell_after(cell.x, counts.x), cell_after(cell.y, counts.y), cell_after(cell.z, counts.z));
  vec4 found = vec4(0.0);
  vec3 gradient = vec3(0.0);
  for (int i = 0; i < 3; i++) {
    int x = (i == 0 ? before.x : (i == 1 ? cell.x : after.x)) * counts.z;
    float weight_x = i == 1 ? 0.5 : 0.25;
    float slope_x = float(i - 1) * 0.5;
    for (int j = 0; j < 3; j++) {
      int y = j == 0 ? before.y : (j == 1 ? cell.y : after.y);
      float weight_y = j == 1 ? 0.5 : 0.25;
      vec4 low = texelFetch(cell_sums, ivec2(x + before.z, y), 0);
      vec4 middle = texelFetch(cell_sums, ivec2(x + cell.z, y), 0);
      vec4 high = texelFetch(cell_sums, ivec2(x + after.z, y), 0);
      vec4 row = 0.5 * (0.5 * (low + high) + middle);
      found += row * (weight_x * weight_y);
      gradient += vec3(slope_x * weight_y, weight_x * float(j - 1) * 0.5, 0.0) * row.x;
      gradient.z += 0.5 * (high.x - low.x) * (weight_x * weight_y);
    }
  }
  imageStore(densities, id, found);
  imageStore(gradients, id, vec4(gradient, 0.0));
}
