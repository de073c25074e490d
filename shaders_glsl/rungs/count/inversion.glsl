// Inversion where few are lit, a matched normal number where many are.
#include "shared/binomial.glsl"

float count(float n, float p, CountDraw random) {
  return binomial(n, p, random.word);
}
