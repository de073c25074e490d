// The ellipse of slopes as a box of its area.
#include "shared/lit_probability_ellipse.glsl"

float probability(vec3 i, vec3 o, float sin2_half_gamma, float alpha) {
  return lit_probability_box(i, o, sin2_half_gamma, alpha);
}
