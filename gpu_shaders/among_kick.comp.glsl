// Hair among hair: pressure, cohesion and friction change the motion of each CV. One invocation a CV.
//
// Twin of kick in addon/dynamics/among.py.
#include "lib_strand_texel.glsl"
#include "lib_among.glsl"

// Smoothing, then the line between two middles: what each of four cells counts along an axis.
vec4 smooth_weights(float part)
{
  return 0.25 * vec4(1.0 - part, 2.0 - part, 1.0 + part, part);
}

vec4 steep_weights(float part)
{
  return 0.5 * vec4(part - 1.0, -part, 1.0 - part, part);
}

// Twin of own_part: the part in density, and its gradient.
vec4 own_part(vec3 part)
{
  vec3 far = min(part, 1.0 - part);
  vec3 along = 0.5 - 0.25 * far;
  vec3 slope = 0.5 * mix(far, -far, vec3(lessThan(part, vec3(0.5))));
  return vec4(along.x * along.y * along.z, slope * along.yxx * along.zzy);
}

void main()
{
  ivec2 id = ivec2(gl_GlobalInvocationID.xy);
  if (id.x >= CV_COUNT || id.y >= among.counts.w) {
    return;
  }
  ivec2 texel = strand_texel(id.y, id.x, CV_COUNT);
  vec4 here = imageLoad(positions, texel);
  vec3 before = vec3(imageLoad(previous_positions, texel).xy, here.w);
  vec4 rest = texelFetch(hair_at_rest, texel, 0);
  AmongCv cv = among_cv(among, here.xyz, before);
  ivec3 counts = among.counts.xyz;
  vec4 wx = smooth_weights(cv.part.x), wy = smooth_weights(cv.part.y), wz = smooth_weights(cv.part.z);
  vec4 sx = steep_weights(cv.part.x), sy = steep_weights(cv.part.y), sz = steep_weights(cv.part.z);
  vec4 found = vec4(0.0);
  vec3 gradient = vec3(0.0);
  for (int x = 0; x < 4; x++) {
    for (int y = 0; y < 4; y++) {
      vec4 row = vec4(0.0);
      float steep = 0.0;
      for (int z = 0; z < 4; z++) {
        vec4 cell = texelFetch(cell_sums, among_texel(counts, cv.low + ivec3(x, y, z) - 1), 0);
        row += cell * wz[z];
        steep += cell.x * sz[z];
      }
      found += row * (wx[x] * wy[y]);
      gradient += vec3(sx[x] * wy[y], wx[x] * sy[y], 0.0) * row.x;
      gradient.z += steep * wx[x] * wy[y];
    }
  }
  vec4 own = own_part(cv.part);
  found -= among_lanes(among, cv.motion, rest.z) * own.x;
  gradient -= own.yzw * rest.z;
  float density = max(found.x, {{among_tiny}});
  float ratio = found.x / rest.y;
  float over = clamp(ratio - (1.0 + {{among_slack}}), 0.0, 1.0);
  float under = clamp(rest.x / rest.y - ratio - {{among_slack}}, 0.0, 1.0);
  vec3 way = gradient * ((under * among.strength.y - over * among.strength.x) / density);
  way *= {{among_farthest}} / max(length(way), {{among_farthest}});
  vec3 kicked = (among.into_x.xyz * way.x + among.into_y.xyz * way.y + among.into_z.xyz * way.z) * among.strength.w;
  vec3 mean = found.yzw / (among.whole * density);
  kicked += (mean - cv.motion) * (min(ratio, 1.0) * among.strength.z);
  before -= kicked / among.speed_ratio;
  imageStore(positions, texel, vec4(here.xyz, before.z));
  imageStore(previous_positions, texel, vec4(before.xy, 0.0, 0.0));
}
