// A product and what its rounding lost.
#include "shared/exact_product.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  return uvec4(floatBitsToUint(exact_product(uintBitsToFloat(a.x), uintBitsToFloat(a.y))), 0u, 0u);
}
