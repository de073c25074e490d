// The chance of any success, through log(1 - p) and 1 - exp by series.
#include "shared/binomial.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return one_minus_exp(a.x * log_one_minus(a.y));
}
