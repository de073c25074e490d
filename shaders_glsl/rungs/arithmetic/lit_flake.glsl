// Whether the flake c, of any length, is lit, in f64: a.w is sin^2(gamma/2).
#include "shared/lit_flake.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return flake_is_lit(c.xyz, a.xyz, b.xyz, double(a.w)) ? 1.0 : 0.0;
}
