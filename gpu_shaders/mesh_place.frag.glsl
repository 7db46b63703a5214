// Places of meshes, fragment stage: the place in the world, and the mesh's number. ALPHA: pixels are
// discarded by hashed alpha, or, where mesh_hash_shift is negative, where the mesh min_covering_alpha no more
// than a fixed fraction.
#ifdef ALPHA
#  include "lib_hashed.glsl"
#endif

void main()
{
#ifdef ALPHA
  float alpha = mesh_alpha;
#  ifdef PICTURES
  alpha *= texture(mesh_color_map, mesh_uv).w;
#  endif
  float hash_shift = gl_FrontFacing ? mesh_hash_shift.x : mesh_hash_shift.y;
  float noise = fract(place_noise(floor(gl_FragCoord.xy)) + hash_shift);
  if (alpha <= (hash_shift < 0.0 ? {{min_covering_alpha}} : noise)) {
    discard;
  }
#endif
  color = vec4(mesh_point, mesh_number);
}
