// G1 / cos of Beckmann with the tangent as it is printed; a.x is the cosine, a.y alpha.
#include "shared/naive_forms.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return naive_beckmann_g1_over_cosine(a.x, a.y);
}
