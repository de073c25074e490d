// The chance 1 - (1 - p)^n of any success, as it is printed; a.x is n, a.y is p.
#include "shared/naive_forms.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return naive_chance_of_any(a.x, a.y);
}
