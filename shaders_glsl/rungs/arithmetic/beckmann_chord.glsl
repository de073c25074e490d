// D of Beckmann with the sine from the chord between h and the normal; a.w is alpha.
#include "shared/microfacet.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return beckmann_d(a.xyz, b.xyz, a.w);
}
