// Counts of successes by a gate and a normal number (Deliot and Belcour 2023).
#ifndef GATED_BINOMIAL_GLSL
#define GATED_BINOMIAL_GLSL

// 1 - (1 - p)^n for p < 1, without the cancellation of its printed form.
float chance_of_any(float n, float p) {
  float s = p / (2.0 - p);
  float z = s * s;
  float minus_log = p < 0.4
    ? 2.0 * s * (1.0 + z * (1.0 / 3.0 + z * (1.0 / 5.0 + z * (1.0 / 7.0 + z * (1.0 / 9.0)))))
    : -log(max(1.0 - p, 1e-30));
  float x = n * minus_log;
  return x < 0.3 ? x * (1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0))))) : 1.0 - exp(-x);
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
