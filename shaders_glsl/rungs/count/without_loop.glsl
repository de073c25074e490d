// Exact thresholds for none, one and two, above them a matched normal number.
#include "shared/binomial.glsl"

float count(float n, float p, CountDraw random) {
  return binomial_without_loop(n, p, random.word);
}
