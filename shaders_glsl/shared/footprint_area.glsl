// The area of a footprint: how many squares of texture a pixel covers.
#ifndef FOOTPRINT_AREA_GLSL
#define FOOTPRINT_AREA_GLSL
#include "shared/exact_product.glsl"

const float LARGEST_SIDE = 1e30; // Of a footprint that has an area.

// The power of two at or below a positive number of 1e-37 to 1e37, and one over it: both exact, and so is what is multiplied
// by them. A quotient would be off by 2.5 units in the last place, and an area by as many times the ratio of its sides.
float octave_of(float number) {
  return uintBitsToFloat(floatBitsToUint(number) & 0x7f800000u);
}

float over_octave_of(float number) {
  return uintBitsToFloat(0x7f000000u - (floatBitsToUint(number) & 0x7f800000u));
}

// The larger of the magnitudes of a side's coordinates, as far as octaves go.
float size_of_side(vec2 side) {
  return clamp(max(abs(side.x), abs(side.y)), 1e-30, LARGEST_SIDE);
}

// The area between two sides, each at most LARGEST_SIDE long: off by 2^-22 of itself, be its axes as 1e6 to 1, while it is
// above 1e-37. Dekker 1971 for the products; each side is brought to 1 to 2 first, where no square leaves the range of floats.
// Infinite where a side is longer, or no number.
float footprint_area(vec2 side_x, vec2 side_y) {
  vec2 sizes = vec2(size_of_side(side_x), size_of_side(side_y));
  vec2 x = side_x * over_octave_of(sizes.x);
  vec2 y = side_y * over_octave_of(sizes.y);
  float area = abs(determinant_of(x.x, x.y, y.x, y.y)) * octave_of(sizes.x) * octave_of(sizes.y);
  // Written so that NaN fails.
  bool measured = all(lessThanEqual(abs(vec4(side_x, side_y)), vec4(LARGEST_SIDE)));
  return measured ? area : uintBitsToFloat(0x7f800000u);
}

#endif
