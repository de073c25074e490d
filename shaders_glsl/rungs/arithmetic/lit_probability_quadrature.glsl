// P(i, o, gamma) by quadrature over the ellipse; a.w is sin^2(gamma/2), b.w alpha.
#include "shared/lit_probability.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return lit_probability(a.xyz, b.xyz, a.w, b.w);
}
