// Soft shadows on skin: look-ups in a head's UV map that respect its islands and close its seams.
//
// Twin of addon/shading/skin/diffusion.py: same names, same order. Textures of
// addon/render/skin_pass.py:
//     texels     x the triangle that the texel shows, yz the weights of its second and third corner, w its
//                island, -1 for none
//     stretches  xy width and height of the texel [m], z the nearest seam, -1 for none
//     seams      four texels each: start and end, xy on the seam's own side and zw on the other; its two
//                islands; the copies of its ends
// Holds no resources.

// MIN_KNOWN and NARROW of diffusion.py
const float SKIN_MIN_KNOWN = 1e-6, SKIN_NARROW = 1.0;

// The fraction of forward-scattered light with which the shadow is blurred: the mean of the colours.
float skin_forward(vec3 forward)
{
  return dot(forward, vec3(1.0 / 3.0));
}

// The blurred shadow in colours. soft: the blurred fraction of light; tau: strands between the light and the
// place itself, limited so that hair accounts for no more than the whole loss; meshes do not tint shadows.
vec3 skin_colored(float soft, float tau, vec3 forward)
{
  // the correction at seams may make it negative
  soft = max(soft, 0.0);
  float mean = skin_forward(forward);
  float lost = -log(clamp(soft, 1.0e-6, 1.0)) / (1.0 - mean);
  return soft * exp(min(max(tau, 0.0), lost) * (forward - mean));
}

ivec2 skin_seam_texel(int seam, int part, int parts)
{
  return ivec2(parts * (seam % {{skin_seams_across}}) + part, seam / {{skin_seams_across}});
}

ivec2 skin_texel_around(sampler2D texels, vec2 place, int corner)
{
  ivec2 texel = ivec2(floor(place - 0.5)) + ivec2(corner & 1, corner >> 1);
  return clamp(texel, ivec2(0), textureSize(texels, 0) - 1);
}

// Bilinear look-up over the texels of one island. known: sum of their weights, 0 to 1.
vec4 skin_looked_up(
    sampler2D values, sampler2D texels, vec2 place, float island, out float known)
{
  vec2 fraction = place - 0.5 - floor(place - 0.5);
  vec4 total = vec4(0.0);
  known = 0.0;
  for (int corner = 0; corner < 4; corner++) {
    ivec2 at = skin_texel_around(texels, place, corner);
    vec2 weights = mix(1.0 - fraction, fraction, vec2(corner & 1, corner >> 1));
    bool is_own = island >= 0.0 && texelFetch(texels, at, 0).w == island;
    float weight = is_own ? weights.x * weights.y : 0.0;
    total += weight * texelFetch(values, at, 0);
    known += weight;
  }
  return total / max(known, SKIN_MIN_KNOWN);
}

// Position on an edge of the place nearest to a point, 0 at the edge's start and 1 at its end.
float skin_along_border(vec2 point, vec2 start, vec2 end)
{
  vec2 edge = end - start;
  return clamp(dot(point - start, edge) / max(dot(edge, edge), 1e-18), 0.0, 1.0);
}

float skin_distance(vec2 place, vec2 start, vec2 end)
{
  return distance(mix(start, end, skin_along_border(place, start, end)), place);
}

// The nearest of the seams stored in the texels around a place, -1 where none is.
int skin_seam_at(
    sampler2D texels, sampler2D stretches, sampler2D seams, vec2 place, float island)
{
  float nearest = 1e30;
  int seam = -1;
  for (int corner = 0; corner < 4; corner++) {
    ivec2 at = skin_texel_around(texels, place, corner);
    int known = int(texelFetch(stretches, at, 0).z);
    if (known < 0 || texelFetch(texels, at, 0).w != island) {
      continue;
    }
    vec2 start = texelFetch(seams, skin_seam_texel(known, 0, 4), 0).xy;
    vec2 end = texelFetch(seams, skin_seam_texel(known, 1, 4), 0).xy;
    float far = skin_distance(place, start, end);
    seam = far < nearest ? known : seam;
    nearest = min(nearest, far);
  }
  return seam;
}

// Look-up that is continuous across seams: the difference that the blur leaves between the two sides is
// split evenly between them. known: as of skin_looked_up.
vec4 skin_soft_shadow(sampler2D values,
                      sampler2D texels,
                      sampler2D stretches,
                      sampler2D seams,
                      sampler2D shifts,
                      vec2 place,
                      float island,
                      out float known)
{
  vec4 found = skin_looked_up(values, texels, place, island, known);
  int seam = skin_seam_at(texels, stretches, seams, place, island);
  if (seam < 0) {
    return found;
  }
  vec4 start = texelFetch(seams, skin_seam_texel(seam, 0, 4), 0);
  vec4 end = texelFetch(seams, skin_seam_texel(seam, 1, 4), 0);
  vec2 islands = texelFetch(seams, skin_seam_texel(seam, 2, 4), 0).xy;
  // at the tip of a slit a texel may store only the other side of the same island
  if (islands.x == islands.y &&
      skin_distance(place, start.zw, end.zw) < skin_distance(place, start.xy, end.xy))
  {
    start = start.zwxy;
    end = end.zwxy;
  }
  float fraction = skin_along_border(place, start.xy, end.xy);
  vec4 on_seam = mix(start, end, fraction);
  float is_here, is_known;
  vec4 here = skin_looked_up(values, texels, on_seam.xy, island, is_here);
  vec4 across = skin_looked_up(values, texels, on_seam.zw, islands.y, is_known);
  vec4 shift = mix(texelFetch(shifts, skin_seam_texel(seam, 0, 2), 0),
                   texelFetch(shifts, skin_seam_texel(seam, 1, 2), 0),
                   fraction);
  float nearness = clamp(1.0 - distance(place, on_seam.xy) / {{skin_closing}}, 0.0, 1.0);
  float fade = is_known > 0.0 ? nearness * nearness * (3.0 - 2.0 * nearness) : 0.0;
  // where both sides lie on the same texels, both use the value between them
  vec2 gap = on_seam.zw - on_seam.xy;
  if (islands.x == islands.y && length(gap) < SKIN_NARROW) {
    float is_between;
    vec2 between = place + 0.5 * fade * gap;
    return skin_looked_up(values, texels, between, island, is_between) + fade * shift;
  }
  return found + fade * (0.5 * (across - here) + shift);
}
