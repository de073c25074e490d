// The distance that stands for the level a.x of Wang and Bowles's grid, its power of 2 written as one of 1.3.

float value(vec4 a, vec4 b, vec4 c) {
  return 0.1 * pow(1.3, a.x / log2(1.3)) - 0.2;
}
