// The density at the cone's axis times its solid angle.
#include "shared/lit_probability_cone.glsl"

float probability(vec3 i, vec3 o, float sin2_half_gamma, float alpha) {
  return lit_probability_small_cone(i, o, sin2_half_gamma, alpha);
}
