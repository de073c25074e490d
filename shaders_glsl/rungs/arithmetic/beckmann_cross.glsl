// D of Beckmann with the sine from the cross product; a.w is alpha.
#include "shared/constants.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  float cosine = dot(a.xyz, b.xyz);
  float cos2 = cosine * cosine;
  vec3 sine = cross(a.xyz, b.xyz);
  float alpha2 = a.w * a.w;
  return exp(-dot(sine, sine) / cos2 / alpha2) / (PI * alpha2 * cos2 * cos2);
}
