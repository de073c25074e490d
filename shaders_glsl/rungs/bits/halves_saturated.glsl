// Two floats as half floats in a word, none of them infinite, and back.
#include "shared/half_float.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  uint packed = packed_halves(uintBitsToFloat(a.xy));
  return uvec4(packed, floatBitsToUint(unpackHalf2x16(packed)), 0u);
}
