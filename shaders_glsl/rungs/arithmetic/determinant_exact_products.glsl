// The determinant of a 2 x 2 matrix from products without error.
#include "shared/exact_product.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return determinant_of(a.x, a.y, a.z, a.w);
}
