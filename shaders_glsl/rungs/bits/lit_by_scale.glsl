// How many flakes shine in a footprint, by three scales as in Wang, Deng and Holzschuch 2020: below 4 flakes each is lit or
// not, to 64 all that are there shine a little, above that all that are expected do. a.x and a.y are the bits of the flakes expected and
// of the probability, a.z and a.w random words, b.x the bits of the flakes in a square. Bits of a float.
#include "shared/binomial.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  float expected = uintBitsToFloat(a.x);
  float probability = uintBitsToFloat(a.y);
  float flakes = uintBitsToFloat(b.x);
  float there = binomial(flakes, expected / flakes, a.z);
  float lit = expected < 4.0 ? binomial(there, probability, a.w) : probability * (expected > 64.0 ? expected : there);
  return uvec4(floatBitsToUint(lit), 0u, 0u, 0u);
}
