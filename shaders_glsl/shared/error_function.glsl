// The error function over intervals.
#ifndef ERROR_FUNCTION_GLSL
#define ERROR_FUNCTION_GLSL

// Complementary error function for x >= 0 (Chebyshev fit, Numerical Recipes 6.2, relative error below 1.2e-7). In f32 below
// 7e-7 (1 + x^2), as x^2 is rounded before exp makes a factor of it; tried on all floats up to 8.
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

// erf(middle + half_width) - erf(middle - half_width), relative error below 3e-6. Narrow intervals by the Taylor series about the
// middle, as differences lose what is narrow, and two ends say less of a width than the width does; differences of erfc where both
// ends lie on one side of 0, so that tails keep digits.
float erf_about(float middle, float half_width) {
  float x = abs(middle);
  if (half_width * (1.0 + x) < 0.1) {
    float x2 = x * x;
    float h2 = half_width * half_width;
    float series = 1.0 + h2 * ((2.0 * x2 - 1.0) / 3.0 + h2 * (x2 * (4.0 * x2 - 12.0) + 3.0) / 30.0);
    return 2.25675833 * half_width * exp(-x2) * series;
  }
  float beyond = erfc_positive(x + half_width);
  float before = erfc_positive(abs(x - half_width));
  return x >= half_width ? before - beyond : 2.0 - before - beyond;
}

#endif
