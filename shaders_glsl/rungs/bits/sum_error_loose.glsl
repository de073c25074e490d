// A sum and what its rounding lost (Knuth 1969), written without `precise`.

uvec4 answer(uvec4 a, uvec4 b) {
  vec2 x = uintBitsToFloat(a.xy);
  float sum = x.x + x.y;
  float y_part = sum - x.x;
  float x_part = sum - y_part;
  float lost = (x.x - x_part) + (x.y - y_part);
  return uvec4(floatBitsToUint(sum), floatBitsToUint(lost), 0u, 0u);
}
