// Sums of floats by many invocations that do not depend on their order.
#ifndef FIXED_POINT_SUM_GLSL
#define FIXED_POINT_SUM_GLSL

// A number as a multiple of 2^-20, the upper word first. For 0 <= x < 2^44; what is below 2^-20 is dropped, which is
// nothing from x = 8 on. Multiples add up exactly in any order, up to 2^44 in all; floats, of which each sum is rounded,
// do not. The carry is found by the invocation that causes it: no 64-bit atomics.
uvec2 fixed_point(float x) {
  float upper = floor(x * (1.0 / 4096.0));
  float rest = x - upper * 4096.0;
  return uvec2(uint(upper), uint(rest * 1048576.0));
}

// Adds to a sum of two words; both arguments name them, as GLSL passes no reference to a buffer.
#define ADD_FIXED_POINT(upper, lower, x) { \
  uvec2 words = fixed_point(x); \
  uint carry = atomicAdd(lower, words.y) > ~words.y ? 1u : 0u; \
  atomicAdd(upper, words.x + carry); \
}

#endif
