// How many of n = a.y flakes, each lit with probability a.z, both floats, for the random word a.x; as a float. By inversion
// as textbooks have it (BINV of Kachitvichyanukul and Schmeiser 1988), 1000 steps at most.
#include "shared/hash.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  float n = uintBitsToFloat(a.y);
  float p = uintBitsToFloat(a.z);
  float u = unit_from(~a.x);
  float odds = p / (1.0 - p);
  float mass = pow(1.0 - p, n);
  float count = 0.0;
  for (int step = 0; step < 1000 && u > mass; ++step) {
    u -= mass;
    count += 1.0;
    mass *= (n + 1.0) * odds / count - odds;
  }
  return uvec4(floatBitsToUint(count), 0u, 0u, 0u);
}
