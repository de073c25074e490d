// P(i, o, gamma) by seven densities over the cone: a is i and alpha, b is o and sin^2(gamma/2).
#include "shared/lit_probability_cone.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return lit_probability_cubature(a.xyz, b.xyz, b.w, a.w);
}
