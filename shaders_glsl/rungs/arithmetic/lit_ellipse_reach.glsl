// P(i, o, gamma) over the ellipse of slopes, its nodes within five alpha of the normal: a is i and alpha, b is o and
// sin^2(gamma/2).
#define NAIVE_FORMS
#include "shared/lit_probability.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return lit_probability(a.xyz, b.xyz, b.w, a.w);
}
