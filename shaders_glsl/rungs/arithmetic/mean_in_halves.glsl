// The mean of a.y numbers from a.x on, each the last plus a.z, their sum and number kept as half floats.

float value(vec4 a, vec4 b, vec4 c) {
  uint packed = 0u;
  for (float k = 0.0; k < a.y; k += 1.0) {
    packed = packHalf2x16(unpackHalf2x16(packed) + vec2(a.x + k * a.z, 1.0));
  }
  vec2 sum = unpackHalf2x16(packed);
  return sum.x / sum.y;
}
