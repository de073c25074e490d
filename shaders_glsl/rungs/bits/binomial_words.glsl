// How many of the 2^32 words give at least k successes in n tries of probability p: a holds the bits of n, p and k. Small words
// are many successes, so that the words that do are those below the answer.
#include "shared/binomial.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  uint words = 0u;
  for (uint bit = 0x80000000u; bit != 0u; bit >>= 1) {
    float count = binomial(uintBitsToFloat(a.x), uintBitsToFloat(a.y), words + bit - 1u);
    words += count >= uintBitsToFloat(a.z) ? bit : 0u;
  }
  return uvec4(words, 0u, 0u, 0u);
}
