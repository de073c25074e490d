// Flakes in a cell of area a.y, from the logarithm a.x of how many a square holds, as an unsigned integer.

float value(vec4 a, vec4 b, vec4 c) {
  return float(uint(a.y * exp(a.x)));
}
