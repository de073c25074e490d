// The determinant of a 2 x 2 matrix, as it is printed.

float value(vec4 a, vec4 b, vec4 c) {
  return a.x * a.w - a.y * a.z;
}
