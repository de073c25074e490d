// Whether a number is finite: whether it is 0 less itself.

uvec4 answer(uvec4 a, uvec4 b) {
  vec4 x = uintBitsToFloat(a);
  return uvec4(equal(x - x, vec4(0.0)));
}
