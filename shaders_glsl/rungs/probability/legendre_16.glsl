// Quadrature over the exact ellipse of slopes with 16 nodes.
#define LIT_PROBABILITY_NODES 16
#include "shared/lit_probability.glsl"

float probability(vec3 i, vec3 o, float sin2_half_gamma, float alpha) {
  return lit_probability(i, o, sin2_half_gamma, alpha);
}
