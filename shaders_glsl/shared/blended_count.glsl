// Counts of successes by inversion between two tabulated probabilities, or by a normal number (Zirr and Kaplanyan 2016).
#ifndef BLENDED_COUNT_GLSL
#define BLENDED_COUNT_GLSL
#include "shared/chances.glsl"
#include "shared/constants.glsl"
#include "shared/hash.glsl"

const float BLENDED_BELOW = 5.0; // Expected successes above which a normal number stands for the count.
const int MOST_BLENDED_COUNT = 17; // The greatest count by inversion.

// A normal number of mean 0 and variance 1 (Box and Muller 1958).
float normal_from(uint key) {
  float radius = sqrt(-2.0 * log(unit_from(hash(key, 5u))));
  return radius * cos(2.0 * PI * unit_from(hash(key, 6u)) - PI);
}

// How many of n flakes, a number that need not be whole, shine with probability p each. Many by a normal number. Few by
// inversion of the distribution, for the two powers of .9 about p, and between them linearly.
float blended_count(float n, float p, uint key, bool root_two, inout int steps_left) {
  float mean = n * p;
  if (mean > BLENDED_BELOW) {
    float deviation = sqrt(mean * (1.0 - p)) * (root_two ? 1.0 : 0.70710678);
    return clamp(mean + deviation * normal_from(key), 0.0, n);
  }
  float power = floor(log2(p) * (-1.0 / 0.15200309));
  float high = exp2(-0.15200309 * power);
  vec2 ends = min(vec2(0.9 * high, high), 1.0 - 1e-6);
  vec2 logs = n * vec2(log_of_rest(ends.x), log_of_rest(ends.y));
  vec2 odds = ends / (1.0 - ends);
  // P(K = k) and P(K > k) from k = 0 on; a number below P(K > k) means more than k.
  vec2 mass = exp(logs);
  vec2 beyond = vec2(one_minus_exp(logs.x), one_minus_exp(logs.y));
  float v = rare_unit_from(hash(key, 7u));
  vec2 count = vec2(0.0);
  for (int k = 0; k < MOST_BLENDED_COUNT && float(k) < n && any(lessThan(vec2(v), beyond)) && steps_left > 0; ++k) {
    --steps_left;
    count += vec2(lessThan(vec2(v), beyond));
    mass *= max(n - float(k), 0.0) / float(k + 1) * odds;
    beyond -= mass;
  }
  float share = ends.y > ends.x ? clamp((p - ends.x) / (ends.y - ends.x), 0.0, 1.0) : 0.0;
  return mix(count.x, count.y, share);
}

#endif
