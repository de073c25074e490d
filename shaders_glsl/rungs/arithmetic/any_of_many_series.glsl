// The chance that any of 64 lights is seen, each by one of the twelve chances in turn, by a sum of logarithms.
#include "shared/chances.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  float chances[12] = float[](a.x, a.y, a.z, a.w, b.x, b.y, b.z, b.w, c.x, c.y, c.z, c.w);
  float log_none = 0.0;
  for (int light = 0; light < 64; ++light) {
    log_none += log_of_rest(chances[light % 12]);
  }
  return one_minus_exp(log_none);
}
