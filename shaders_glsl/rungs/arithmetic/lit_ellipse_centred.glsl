// P(i, o, gamma) over the ellipse of slopes as seen from its centre: a is i and alpha, b is o and sin^2(gamma/2).
#include "shared/lit_probability.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return lit_probability(a.xyz, b.xyz, b.w, a.w);
}
