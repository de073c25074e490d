// The determinant of a 2 x 2 matrix, as it is printed.
#include "shared/naive_forms.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return naive_determinant(a.x, a.y, a.z, a.w);
}
