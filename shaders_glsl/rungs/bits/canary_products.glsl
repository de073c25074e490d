// What a device makes of a sum of products, less a.y, the rounded square of a.x: plain, and by fma.

uvec4 answer(uvec4 a, uvec4 b) {
  float x = uintBitsToFloat(a.x);
  float rounded = uintBitsToFloat(a.y);
  float plain = x * x - rounded;
  precise float by_fma = fma(x, x, -rounded);
  return uvec4(floatBitsToUint(plain), floatBitsToUint(by_fma), 0u, 0u);
}
