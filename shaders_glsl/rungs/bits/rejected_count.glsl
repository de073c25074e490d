// A Poisson count by transformed rejection (Hoermann 1993, PTRS), for means of 10 and more: a.x holds the bits of the mean, a.y is
// the seed. Whether a pair of random numbers is accepted depends on the mean, and the next pair has nothing to do with
// it. Bits of a float.
#include "shared/constants.glsl"
#include "shared/hash.glsl"

const uint MOST_PAIRS = 64u;

// The logarithm of k! by Stirling's series, for k > 0.
float log_factorial(float k) {
  return (k + 0.5) * log(k) - k + 0.5 * log(2.0 * PI) + 1.0 / (12.0 * k);
}

uvec4 answer(uvec4 a, uvec4 b) {
  float mean = uintBitsToFloat(a.x);
  float scale = 0.931 + 2.53 * sqrt(mean);
  float hat = 0.02483 * scale - 0.059;
  float inverse_alpha = 1.1239 + 1.1328 / (scale - 3.4);
  float surely = 0.9277 - 3.6224 / (scale - 2.0);
  float count = mean;
  for (uint pair = 0u; pair < MOST_PAIRS; ++pair) {
    float u = unit_from(hash(2u * pair, a.y)) - 0.5;
    float v = unit_from(hash(2u * pair + 1u, a.y));
    float side = 0.5 - abs(u);
    float k = floor((2.0 * hat / side + scale) * u + mean + 0.43);
    bool accepted = side >= 0.07 && v <= surely;
    bool refused = k < 1.0 || (side < 0.013 && v > side);
    accepted = accepted || (!refused
      && log(v * inverse_alpha / (hat / (side * side) + scale)) <= k * log(mean) - mean - log_factorial(max(k, 1.0)));
    if (accepted) {
      count = k;
      break;
    }
  }
  return uvec4(floatBitsToUint(count), 0u, 0u, 0u);
}
