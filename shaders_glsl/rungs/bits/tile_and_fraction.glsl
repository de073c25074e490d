// Splits two coordinates into tiles and what is left: the words of floor(x) as integers, those of x - floor(x) as floats.

uvec4 answer(uvec4 a, uvec4 b) {
  vec2 x = uintBitsToFloat(a.xy);
  vec2 tile = floor(x);
  return uvec4(uvec2(ivec2(tile)), floatBitsToUint(min(x - tile, 0.99999994)));
}
