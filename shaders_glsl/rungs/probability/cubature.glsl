// Seven densities over the cone.
#include "shared/lit_probability_cone.glsl"

float probability(vec3 i, vec3 o, float sin2_half_gamma, float alpha) {
  return lit_probability_cubature(i, o, sin2_half_gamma, alpha);
}
