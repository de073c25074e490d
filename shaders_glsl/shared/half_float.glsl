// Half floats in words.
#ifndef HALF_FLOAT_GLSL
#define HALF_FLOAT_GLSL

const float GREATEST_HALF = 65504.0; // Greatest finite half float.

// Two half floats in a word, the first in its lower half. Numbers beyond the greatest half float become that one: the
// conversion itself may make them infinite from 65520 on. For all x but NaN; within 2^-10 relative from 2^-14 on, and
// within 2^-24 below, as rounding may go either way (Vulkan, "Precision and Operation of SPIR-V Instructions").
uint packed_halves(vec2 x) {
  return packHalf2x16(clamp(x, vec2(-GREATEST_HALF), vec2(GREATEST_HALF)));
}

#endif
