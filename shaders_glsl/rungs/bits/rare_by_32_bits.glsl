// Whether a random word says yes to a chance, the float a.y, by all its bits.
#include "shared/hash.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  return uvec4(rare_unit_from(a.x) < uintBitsToFloat(a.y) ? 1u : 0u, 0u, 0u, 0u);
}
