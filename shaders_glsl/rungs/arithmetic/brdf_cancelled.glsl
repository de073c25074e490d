// D G / (4 (i.n) (o.n)) of Beckmann with the cosines cancelled by hand; i and o about +Z, a.w is alpha.
#include "shared/microfacet.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  float masking = beckmann_g1_over_cosine(a.z, a.w) * beckmann_g1_over_cosine(b.z, a.w);
  return 0.25 * beckmann_d(half_vector(a.xyz, b.xyz), vec3(0.0, 0.0, 1.0), a.w) * masking;
}
