// P(i, o, gamma) over the solid angle of the cone as 4 pi sin^2(gamma/2); a.w is sin^2(gamma/2), b.w alpha.
#include "shared/lit_probability.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return lit_probability(a.xyz, b.xyz, a.w, b.w) / (4.0 * PI * a.w);
}
