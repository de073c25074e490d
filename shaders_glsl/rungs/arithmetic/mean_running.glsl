// The mean of a.y numbers from a.x on, each the last plus a.z, kept as it is accumulated.
#include "shared/running_mean.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  vec4 mean = vec4(0.0);
  for (uint k = 0u; k < uint(a.y); ++k) {
    mean = running_mean(mean, vec4(a.x + float(k) * a.z), k);
  }
  return mean.x;
}
