// Angles between unit vectors, and their sines, from sums, products and roots: a device's own arc sine may be wrong by 4096
// units in the last place and its sine by 2^-11 (Vulkan, "Precision of Individual Operations").
#ifndef ANGLES_GLSL
#define ANGLES_GLSL
#include "shared/constants.glsl"

// For 0 <= x <= 0.7072: the angle of half of so long a chord. Relative error below 3e-8 before rounding (Chebyshev series
// of asin(x) / x in x^2).
float asin_of(float x) {
  float z = x * x;
  float series = 0.11196089859754196;
  series = -0.09404627594464651 + z * series;
  series = 0.07822891896054235 + z * series;
  series = 0.0158279045218027 + z * series;
  series = 0.04663621561390213 + z * series;
  series = 0.07486847096170064 + z * series;
  series = 0.1666699323574563 + z * series;
  series = 0.9999999868093988 + z * series;
  return x * series;
}

// The angle between two unit vectors, 0 to pi: from their chord, or where they point apart from that to the opposite
// (as `AngleBetween` of pbrt, 4th edition, section 8.1.2). acos of their product has no digits left at 3e-4.
// Relative error below 1e-6 from 1e-4 on; below, what the vectors lack of unit length tells: 5e-5 at 1e-5.
float angle_between(vec3 a, vec3 b) {
  bool apart = dot(a, b) < 0.0;
  float from = 2.0 * asin_of(min(0.5 * length(apart ? a + b : a - b), 0.7072));
  return apart ? PI - from : from;
}

// The sine of the angle between two unit vectors, from both chords: sqrt(1 - cos^2) has no digits left at 3e-4. Relative error as
// above.
float sine_between(vec3 a, vec3 b) {
  return 0.5 * length(a - b) * length(a + b);
}

// The sine of an angle of 0 to pi, error below 2e-7 (Chebyshev series of sin(x) / x in x^2).
float sine_of(float angle) {
  float x = min(angle, PI - angle);
  float z = x * x;
  float series = 2.6051662765032516e-6;
  series = -1.9809046357600297e-4 + z * series;
  series = 0.008333050617331165 + z * series;
  series = -0.1666665796990488 + z * series;
  series = 0.9999999957158401 + z * series;
  return x * series;
}

#endif
