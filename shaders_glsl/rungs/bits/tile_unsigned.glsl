// Splits two coordinates into cells as unsigned integers, and what is left by `fract`.

uvec4 answer(uvec4 a, uvec4 b) {
  vec2 x = uintBitsToFloat(a.xy);
  return uvec4(uvec2(floor(x)), floatBitsToUint(fract(x)));
}
