// Splits two coordinates into cells by rounding towards zero, and what is left by `fract`.

uvec4 answer(uvec4 a, uvec4 b) {
  vec2 x = uintBitsToFloat(a.xy);
  return uvec4(uvec2(ivec2(x)), floatBitsToUint(fract(x)));
}
