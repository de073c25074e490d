// How many of n = a.y flakes, each lit with probability a.z, both floats, for the random word a.x; as a float.
#include "shared/binomial.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  return uvec4(floatBitsToUint(binomial(uintBitsToFloat(a.y), uintBitsToFloat(a.z), a.x)), 0u, 0u, 0u);
}
