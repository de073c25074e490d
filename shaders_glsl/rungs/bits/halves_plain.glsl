// Two floats as half floats in a word, and back.

uvec4 answer(uvec4 a, uvec4 b) {
  uint packed = packHalf2x16(uintBitsToFloat(a.xy));
  return uvec4(packed, floatBitsToUint(unpackHalf2x16(packed)), 0u);
}
