// The half vector of a and b, along c, and 0 where there is none.
#include "shared/microfacet.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return dot(half_vector(a.xyz, b.xyz), c.xyz);
}
