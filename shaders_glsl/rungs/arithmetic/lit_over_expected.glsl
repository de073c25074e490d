// The lit flakes of a footprint over how many are expected, as Zirr and Kaplanyan 2016 and Deliot and Belcour 2023 take them:
// counted by a gate and a normal number, divided by flakes times area times probability. Sides a.xy and a.zw, b.x flakes in a
// square of texture, b.y the probability, c.x uniform and c.y a normal number.
#include "shared/gated_binomial.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  float n = b.x * abs(a.x * a.w - a.y * a.z);
  return gated_binomial(n, b.y, vec4(c.x), vec4(c.y), false).x / (n * b.y);
}
