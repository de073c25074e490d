// P(i, o, gamma) by the density at the cone's axis for all of it: a is i and alpha, b is o and sin^2(gamma/2).
#include "shared/lit_probability_cone.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return lit_probability_small_cone(a.xyz, b.xyz, b.w, a.w);
}
