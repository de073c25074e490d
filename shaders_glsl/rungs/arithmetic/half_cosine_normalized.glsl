// i.h by the half vector.
#include "shared/naive_forms.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return naive_half_vector_cosine(a.xyz, b.xyz);
}
