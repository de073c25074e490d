// lambda_1 of the conic of Jakob et al. 2014 from |i + o|^2; a.w is sin^2(gamma/2).
#include "shared/reflecting_set.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return conic_across(a.xyz + b.xyz, a.w) / (2.0 * a.w);
}
