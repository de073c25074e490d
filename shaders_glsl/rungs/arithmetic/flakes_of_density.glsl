// Flakes in a cell of area a.y, from the logarithm a.x of how many a square holds.
#include "shared/gated_binomial.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return flakes_in_cell(a.x, a.y);
}
