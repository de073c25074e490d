// The error function, and differences of it.
#ifndef ERROR_FUNCTION_GLSL
#define ERROR_FUNCTION_GLSL

// Complementary error function for x >= 0, relative error below 1.2e-7 (Chebyshev fit, Numerical Recipes 6.2).
float erfc_positive(float x) {
  float t = 1.0 / (1.0 + 0.5 * x);
  float series = 0.17087277;
  series = -0.82215223 + t * series;
  series = 1.48851587 + t * series;
  series = -1.13520398 + t * series;
  series = 0.27886807 + t * series;
  series = -0.18628806 + t * series;
  series = 0.09678418 + t * series;
  series = 0.37409196 + t * series;
  series = 1.00002368 + t * series;
  series = -1.26551223 + t * series;
  return t * exp(-x * x + series);
}

// erf(high) - erf(low) for low <= high; differences of erfc where both lie on one side of 0, so that tails keep digits.
float erf_between(float low, float high) {
  if (low >= 0.0) {
    return erfc_positive(low) - erfc_positive(high);
  }
  if (high <= 0.0) {
    return erfc_positive(-high) - erfc_positive(-low);
  }
  return 2.0 - erfc_positive(high) - erfc_positive(-low);
}

#endif
