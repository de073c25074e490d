// What is a number.
#ifndef FINITE_GLSL
#define FINITE_GLSL

// Neither infinite nor NaN, for every x and on every device. From the exponent's bits: a compiler may take it that there is no
// NaN, and then isnan(x), x != x and x - x == 0 are constants (Vulkan promises NaN only with SignedZeroInfNanPreserve).
bool is_finite(float x) {
  return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u;
}

#endif
