// A hash of a cell by the bits of its coordinates.
#include "shared/hash.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  vec2 cell = floor(uintBitsToFloat(a.xy));
  return uvec4(hash(floatBitsToUint(cell.x), floatBitsToUint(cell.y)));
}
