// P-hat of Wang, Deng and Holzschuch 2020, Eq. 17, in closed form; a is o.n, alpha and sin^2(gamma/2).
#include "shared/selection_probability.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return selection_probability(a.x, a.y, a.z);
}
