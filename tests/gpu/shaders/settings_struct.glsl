// One texel per member of the struct that params/glsl.py writes.

void main()
{
  vec4 members[7];
  members[0] = vec4(odd.first, 0.0, 0.0, 0.0);
  members[1] = vec4(odd.tint, 0.0);
  members[2] = vec4(odd.behind_tint, 0.0, 0.0, 0.0);
  members[3] = vec4(float(odd.whole), 0.0, 0.0, 0.0);
  members[4] = vec4(float(odd.is_on), float(odd.is_off), 0.0, 0.0);
  members[5] = vec4(odd.other_tint, 0.0);
  members[6] = vec4(float(odd.mode), odd.last, 0.0, 0.0);
  int at = int(gl_GlobalInvocationID.x);
  if (at < 7 && gl_GlobalInvocationID.y == 0u) {
    imageStore(result, ivec2(at, 0), members[at]);
  }
}
