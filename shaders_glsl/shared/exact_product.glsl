// Differences of products in f32 whose digits survive cancellation.
#ifndef EXACT_PRODUCT_GLSL
#define EXACT_PRODUCT_GLSL
#ifdef NAIVE_FORMS
#include "shared/naive_forms.glsl"
#endif

// A product and what its rounding lost, exactly (Dekker 1971), of factors below 1e34 in magnitude whose product is 0 or between
// 1e-30 and 1e38. fma would do it in one step, but need not be fused.
vec2 exact_product(float x, float y) {
  const float SPLIT = 4097.0;
  precise float product = x * y;
  precise float x_scaled = SPLIT * x;
  precise float x_high = x_scaled - (x_scaled - x);
  precise float x_low = x - x_high;
  precise float y_scaled = SPLIT * y;
  precise float y_high = y_scaled - (y_scaled - y);
  precise float y_low = y - y_high;
  precise float rest = ((x_high * y_high - product) + x_high * y_low + x_low * y_high) + x_low * y_low;
  return vec2(product, rest);
}

// a d - b c, off by 2^-23 of itself and 2^-46 of the products. Of such factors as above.
float determinant_of(float a, float b, float c, float d) {
#ifdef NAIVE_FORMS
  return naive_determinant(a, b, c, d);
#else
  vec2 p = exact_product(a, d);
  vec2 q = exact_product(b, c);
  precise float difference = p.x - q.x;
  precise float rest = p.y - q.y;
  precise float sum = difference + rest;
  return sum;
#endif
}

#endif
