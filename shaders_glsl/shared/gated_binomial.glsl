// Counts of successes by a gate and a normal number (Deliot and Belcour 2023).
#ifndef GATED_BINOMIAL_GLSL
#define GATED_BINOMIAL_GLSL
#include "shared/chances.glsl"

// Flakes in a cell of an area, from the logarithm of how many a square of texture holds: below 1e30, whatever that is.
// Within what the device's exp is off by: 1.3e-5 relative at the largest.
float flakes_in_cell(float log_density, float area) {
  return min(area * exp(min(log_density, 50.0)), 1e30);
}

// Four counts of successes among n tries, each of probability p, from uniform and normal numbers: a soft gate says whether
// there is one at all, a normal number how many more. As printed, or with fewer than one try repaired.
vec4 gated_binomial(float n, float p, vec4 uniforms, vec4 normal_numbers, bool repair) {
  float any_lit = repair ? (n < 1.0 ? n * p : chance_of_any(n, p)) : 1.0 - pow(1.0 - p, n);
  float softness = 0.1 * clamp(10.0 * any_lit, 0.0, 1.0) * clamp(10.0 * (1.0 - any_lit), 0.0, 1.0);
  vec4 gate = clamp((any_lit + softness - uniforms) / max(2.0 * softness, 1e-30), 0.0, 1.0);
  float mean = (n - 1.0) * p;
  // Printed without the maximum, and no number where n < 1; minimum and maximum then take 0 for the count above one.
  float deviation = sqrt(max(mean * (1.0 - p), 0.0));
  float most = repair ? max(n - 1.0, 0.0) : n;
  return gate * (1.0 + clamp(floor(normal_numbers * deviation + mean), 0.0, most));
}

#endif
