// The normal number exceeded with the probability that a float is.
#include "shared/binomial.glsl"

float helper(uint word) {
  return normal_exceeded(uintBitsToFloat(word));
}
