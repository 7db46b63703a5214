// Depths of meshes as a light sees them, fragment stage. What is nearer than where the map begins
// counts as if it lay there. ALPHA: it has as many holes as alpha asks for, a texel each.
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
  // sheets behind one another have their holes at different texels
  vec2 texel = floor(gl_FragCoord.xy) * vec2(1.0, mesh_chance.x);
  if (alpha <= fract(place_noise(gl_FrontFacing ? texel : texel.yx) + mesh_chance.y)) {
    discard;
  }
#endif
  gl_FragDepth = clamp(mesh_depth, 0.0, 1.0);
}
