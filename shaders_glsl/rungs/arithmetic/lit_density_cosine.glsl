// P(i, o, gamma) over the solid angle of the cone as 2 pi (1 - cos gamma); a.w is sin^2(gamma/2), b.w alpha, c.x cos(gamma).
#include "shared/lit_probability.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return lit_probability(a.xyz, b.xyz, a.w, b.w) / (2.0 * PI * (1.0 - c.x));
}
