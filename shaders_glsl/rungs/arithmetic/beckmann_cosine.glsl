// D of Beckmann from the cosine alone; a.w is alpha.
#include "shared/constants.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  float cosine = dot(a.xyz, b.xyz);
  float cos2 = cosine * cosine;
  float alpha2 = a.w * a.w;
  return exp(-(1.0 - cos2) / cos2 / alpha2) / (PI * alpha2 * cos2 * cos2);
}
