// The complementary error function of a float.
#include "shared/error_function.glsl"

float helper(uint word) {
  return erfc_positive(uintBitsToFloat(word));
}
