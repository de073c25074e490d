// Shifts, a quotient and conversions with their edges closed.
#include "shared/integer_edges.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  float x = uintBitsToFloat(b.x);
  uint moved = b.y == 0u ? shifted_left(a.x, a.y) : shifted_right(a.x, a.y);
  return uvec4(moved, quotient(a.x, a.z), uint(integer_from(x)), whole_from(x));
}
