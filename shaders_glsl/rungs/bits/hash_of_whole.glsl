// A hash of a cell by its coordinates as integers.
#include "shared/footprint_ellipse.glsl"
#include "shared/hash.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  vec2 cell = floor(uintBitsToFloat(a.xy));
  uvec2 x = words_of(cell.x);
  uvec2 y = words_of(cell.y);
  return uvec4(hash(x.x, x.y, hash(y.x, y.y)));
}
