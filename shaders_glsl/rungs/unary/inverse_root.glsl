// 1 / sqrt of a float.
#include "shared/flake_set.glsl"

float helper(uint word) {
  return inverse_root(uintBitsToFloat(word));
}
