// The integral of a clamped coordinate up to a float.
#include "shared/footprint.glsl"

float helper(uint word) {
  return clamped_integral(uintBitsToFloat(word));
}
