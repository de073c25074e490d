// ln(1 - p) of a float.
#include "shared/chances.glsl"

float helper(uint word) {
  return log_of_rest(uintBitsToFloat(word));
}
