// Places of meshes, fragment stage: the place in the world, and the mesh's number. ALPHA: pixels are
// discarded by hashed alpha, or, where mesh_chance is negative, where the mesh covers no more than a fixed
// fraction.
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
  float chance = gl_FrontFacing ? mesh_chance.x : mesh_chance.y;
  float noise = fract(place_noise(floor(gl_FragCoord.xy)) + chance);
  if (alpha <= (chance < 0.0 ? {{covers}} : noise)) {
    discard;
  }
#endif
  color = vec4(mesh_point, mesh_number);
}
