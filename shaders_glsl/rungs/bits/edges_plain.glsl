// Shifts, a quotient and conversions, as the language has them.

uvec4 answer(uvec4 a, uvec4 b) {
  float x = uintBitsToFloat(b.x);
  return uvec4(b.y == 0u ? a.x << a.y : a.x >> a.y, a.x / a.z, uint(int(x)), uint(x));
}
