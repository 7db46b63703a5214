// Depths of meshes in a light's shadow map, fragment stage. Depths nearer than the begin of the map are
// clamped to it. ALPHA: holes of one texel, as many as alpha requires.
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
  // front and back faces, and different meshes, have their holes at different texels
  vec2 texel = floor(gl_FragCoord.xy) * vec2(1.0, mesh_hash_shift.x);
  if (alpha <= fract(place_noise(gl_FrontFacing ? texel : texel.yx) + mesh_hash_shift.y)) {
    discard;
  }
#endif
  gl_FragDepth = clamp(mesh_depth, 0.0, 1.0);
}
