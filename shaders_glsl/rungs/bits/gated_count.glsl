// Successes by a soft gate and a rounded normal number, as Deliot and Belcour 2023 print it: a holds the bits of n, p, a uniform
// and a normal number. Bits of a float.
#include "shared/gated_binomial.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  vec4 of = uintBitsToFloat(a);
  return uvec4(floatBitsToUint(gated_binomial(of.x, of.y, vec4(of.z), vec4(of.w), false).x), 0u, 0u, 0u);
}
