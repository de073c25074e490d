// The chance 1 - (1 - p)^n of any success, as it is printed; a.x is n, a.y is p.

float value(vec4 a, vec4 b, vec4 c) {
  return 1.0 - pow(1.0 - a.y, a.x);
}
