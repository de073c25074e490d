// A soft gate and a normal number, as Deliot and Belcour 2023 print it.
#include "shared/gated_binomial.glsl"

float count(float n, float p, CountDraw random) {
  return gated_binomial(n, p, vec4(random.uniform_number), vec4(random.normal_number), false).x;
}
