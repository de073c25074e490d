// P(i, o, gamma) from the density of reflected directions, for Beckmann normals and cones narrower than the lobe.
#ifndef LIT_PROBABILITY_CONE_GLSL
#define LIT_PROBABILITY_CONE_GLSL
#include "shared/constants.glsl"
#include "shared/directions.glsl"

// D(h) (h.n) / (4 i.h): how probable it is, per steradian about o, that a flake reflects i there. Directions are unit
// vectors about n = +Z; the lengths of i + o cancel.
float lit_density(vec3 i, vec3 o, float alpha) {
  vec3 sum = i + o;
  float length2 = dot(sum, sum);
  if (length2 < 1e-12 || sum.z <= 0.0) {
    return 0.0;
  }
  float alpha2 = alpha * alpha;
  float z2 = sum.z * sum.z;
  return exp(-dot(sum.xy, sum.xy) / (z2 * alpha2)) * length2 / (2.0 * PI * alpha2 * z2 * sum.z);
}

// The density at the cone's axis for all of the cone.
float lit_probability_small_cone(vec3 i, vec3 o, float sin2_half_gamma, float alpha) {
  return 4.0 * PI * sin2_half_gamma * lit_density(i, o, alpha);
}

// The mean of seven densities: at the axis, and six on a ring that parts the cone's solid angle at two thirds. Exact for
// polynomials of the fifth degree on a flat disk (Abramowitz and Stegun 1964, 25.4.61).
float lit_probability_cubature(vec3 i, vec3 o, float sin2_half_gamma, float alpha) {
  float from_axis = 4.0 / 3.0 * sin2_half_gamma;
  float sine = sqrt(from_axis * (2.0 - from_axis));
  mat3 frame = frame_about(o);
  vec3 ring = (1.0 - from_axis) * o;
  vec3 x = sine * frame[0];
  vec3 near_x = 0.5 * x;
  vec3 y = 0.86602540 * sine * frame[1];
  float on_ring = lit_density(i, ring + x, alpha) + lit_density(i, ring - x, alpha)
    + lit_density(i, ring + near_x + y, alpha) + lit_density(i, ring + near_x - y, alpha)
    + lit_density(i, ring - near_x + y, alpha) + lit_density(i, ring - near_x - y, alpha);
  return 4.0 * PI * sin2_half_gamma * (0.25 * lit_density(i, o, alpha) + 0.125 * on_ring);
}

#endif
