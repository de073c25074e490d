// Whether the flake c is lit: the chord from o to where it mirrors i, against 4 sin^2(gamma/2).
#include "shared/reflecting_set.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return reflects_into_cone(c.xyz, a.xyz, b.xyz, a.w) ? 1.0 : 0.0;
}
