// A soft gate and a normal number, repaired where less than one flake is expected.
#include "shared/gated_binomial.glsl"

float count(float n, float p, CountDraw random) {
  return gated_binomial(n, p, vec4(random.uniform_number), vec4(random.normal_number), true).x;
}
