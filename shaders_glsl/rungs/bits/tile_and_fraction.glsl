// Splits two coordinates into cells and what is left: the words of their indices, and of what is left as floats.
#include "shared/cells.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  vec2 x = uintBitsToFloat(a.xy);
  return uvec4(uvec2(cell_of(x)), floatBitsToUint(within_cell(x)));
}
