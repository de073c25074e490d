// A product and what its rounding lost, by fma: so if it is fused, 0 if not.

uvec4 answer(uvec4 a, uvec4 b) {
  vec2 x = uintBitsToFloat(a.xy);
  precise float product = x.x * x.y;
  precise float rest = fma(x.x, x.y, -product);
  return uvec4(floatBitsToUint(product), floatBitsToUint(rest), 0u, 0u);
}
