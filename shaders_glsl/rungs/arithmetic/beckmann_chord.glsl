// D of Beckmann with sine and cosine from the chord between h and the normal; a.w is alpha.
#include "shared/constants.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  vec3 chord = a.xyz - b.xyz;
  float chord2 = dot(chord, chord);
  float cosine = 1.0 - 0.5 * chord2;
  float cos2 = cosine * cosine;
  float tan2 = chord2 * (1.0 - 0.25 * chord2) / cos2;
  float alpha2 = a.w * a.w;
  return exp(-tan2 / alpha2) / (PI * alpha2 * cos2 * cos2);
}
