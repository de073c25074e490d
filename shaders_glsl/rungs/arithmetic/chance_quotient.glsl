// The chance to choose the first of two parts that hold a.x and a.y, as it is printed.

float value(vec4 a, vec4 b, vec4 c) {
  return a.x / (a.x + a.y);
}
