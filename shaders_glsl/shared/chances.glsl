// Chances that keep their digits where they are rare: of none, and of any.
//
// 1 - p loses the digits of a small p, and a device's log may be off by 2^-21 near 1, its exp near 0 by more than what is
// left of 1 - exp (Vulkan specification, precision of GLSL.std.450): both are series there. Bounds are for any device: they
// count the roundings, and what Vulkan lets exp, log and division be off by.
#ifndef CHANCES_GLSL
#define CHANCES_GLSL
#ifdef NAIVE_FORMS
#include "shared/naive_forms.glsl"
#endif

// log(1 - p) for 0 <= p <= 1/2, within 6e-7 relative: twice the series of artanh(p / (p - 2)).
float log_one_minus(float p) {
#ifdef NAIVE_FORMS
  return log(1.0 - p);
#else
  float s = -p / (2.0 - p);
  float z = s * s;
  return 2.0 * s * (1.0 + z * (1.0 / 3.0 + z * (1.0 / 5.0 + z * (1.0 / 7.0 + z * (1.0 / 9.0 + z / 11.0)))));
#endif
}

// log(1 - p) for 0 <= p <= 1, within 1e-6 relative; p = 1 counts as 1 - 1e-30.
float log_of_rest(float p) {
  return p <= 0.5 ? log_one_minus(p) : log(max(1.0 - p, 1e-30));
}

// 1 - exp(x) for x <= 0, within 1.5e-6 relative: Taylor's series near 0.
float one_minus_exp(float x) {
#ifdef NAIVE_FORMS
  return 1.0 - exp(x);
#else
  float series = 1.0 + x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0 + x * (1.0 / 120.0 + x / 720.0))));
  return x > -0.3 ? -x * series : 1.0 - exp(x);
#endif
}

// 1 - (1 - p)^n: the chance of any success in n >= 0 tries, for 0 <= p <= 1, within 2.6e-6 relative:
// what the two above are off by, and a rounding.
float chance_of_any(float n, float p) {
#ifdef NAIVE_FORMS
  return naive_chance_of_any(n, p);
#else
  return one_minus_exp(n * log_of_rest(p));
#endif
}

#endif
