// Sums of floats by many invocations that do not depend on their order.
#ifndef FIXED_POINT_SUM_GLSL
#define FIXED_POINT_SUM_GLSL

// A number as a multiple of 2^-20, the upper word first: the nearest, hence off by 2^-21 at most, and by nothing from x = 8
// on. Domain: all floats. From 2^44 on they count as the greatest float below it; negative ones, and what is no number, as 0.
uvec2 fixed_point(float x) {
  float kept = x > 0.0 ? min(x, 17592184995840.0) : 0.0;
  float upper = floor(kept * (1.0 / 4096.0));
  float rest = kept - upper * 4096.0;
  return uvec2(uint(upper), uint(roundEven(rest * 1048576.0)));
}

// Adds to a sum of two words; both arguments name them, as GLSL passes no reference to a buffer. Multiples add up exactly in
// any order; floats, of which each sum is rounded, do not. The carry is found by the invocation that causes it: no 64-bit
// atomics. An upper word of 2^32 - 1 stands for 2^44 - 4096 or more: whoever carries the sum past its end leaves it there.
#define ADD_FIXED_POINT(upper, lower, x) { \
  uvec2 words = fixed_point(x); \
  uint raised = words.x + (atomicAdd(lower, words.y) > ~words.y ? 1u : 0u); \
  if (atomicAdd(upper, raised) > ~raised) { \
    atomicMax(upper, 0xffffffffu); \
  } \
}

#endif
