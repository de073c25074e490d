// Whether a number is finite, by its bits.
#include "shared/finite.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  vec4 x = uintBitsToFloat(a);
  return uvec4(is_finite(x.x), is_finite(x.y), is_finite(x.z), is_finite(x.w));
}
