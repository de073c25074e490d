// i.h as half the length of i + o.
#include "shared/microfacet.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return half_vector_cosine(a.xyz, b.xyz);
}
