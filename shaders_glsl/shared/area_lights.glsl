// What area lights need where they are small, distant or dark: points between directions on the sphere, and the chance to
// look into one of two parts.
#ifndef AREA_LIGHTS_GLSL
#define AREA_LIGHTS_GLSL
#include "shared/angles.glsl"

// The point at a fraction t of the arc from a to b, unit vectors that are not opposite (Shoemake 1985). Below a sine of
// 1e-3 the chord serves, which leaves the arc by 1.3e-7 at most; above it quotients of sines have all their digits.
// Error below 1e-6 up to an angle of 2.5 radians, and in proportion to 1 / sin beyond.
vec3 slerp(vec3 a, vec3 b, float t) {
  float sine = sine_between(a, b);
  if (sine < 1e-3) {
    return mix(a, b, t);
  }
  float angle = angle_between(a, b);
  return (sine_of((1.0 - t) * angle) * a + sine_of(t * angle) * b) / sine;
}

// The chance to choose the first of two parts in proportion to what they hold, 0 to 1e37 each; even where both hold
// nothing, so that what follows may divide by it. Sums below 1e-30 count as nothing: devices may flush them.
float chance_of_first(float first, float second) {
  float both = first + second;
  return both > 1e-30 ? min(first / both, 1.0) : 0.5;
}

#endif
