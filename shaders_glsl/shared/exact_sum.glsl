// Sums in f32 and what their rounding loses.
#ifndef EXACT_SUM_GLSL
#define EXACT_SUM_GLSL

// A sum and what its rounding lost, exactly, whichever is larger (Knuth 1969, TwoSum), short of overflow. Without `precise`
// the compiler finds that nothing was lost.
vec2 exact_sum(float x, float y) {
  precise float sum = x + y;
  precise float y_part = sum - x;
  precise float x_part = sum - y_part;
  precise float x_lost = x - x_part;
  precise float y_lost = y - y_part;
  precise float lost = x_lost + y_lost;
  return vec2(sum, lost);
}

#endif
