// How many of n = a.y flakes, each lit with probability a.z, both floats, for the random word a.x; as a float. By inversion
// below a mean of 16, and by a rounded normal number above.
#include "shared/binomial.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  float n = uintBitsToFloat(a.y);
  float p = uintBitsToFloat(a.z);
  float mean = n * p;
  float z = normal_exceeded(clamp(rare_unit_from(a.x), 1e-9, 0.99999994));
  float count = mean < 16.0 ? binomial(n, p, a.x) : clamp(floor(mean + 0.5 + sqrt(mean * (1.0 - p)) * z), 0.0, n);
  return uvec4(floatBitsToUint(count), 0u, 0u, 0u);
}
