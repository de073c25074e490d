// G1 / cos of Beckmann with the cosine cancelled by hand.
#include "shared/microfacet.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return beckmann_g1_over_cosine(a.x, a.y);
}
