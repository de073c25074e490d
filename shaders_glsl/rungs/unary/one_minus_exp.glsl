// 1 - exp(x) of a float.
#include "shared/chances.glsl"

float helper(uint word) {
  return one_minus_exp(uintBitsToFloat(word));
}
