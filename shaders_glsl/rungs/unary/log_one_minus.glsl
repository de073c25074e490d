// log(1 - p) of a float.
#include "shared/binomial.glsl"

float helper(uint word) {
  return log_one_minus(uintBitsToFloat(word));
}
