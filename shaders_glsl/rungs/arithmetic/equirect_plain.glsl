// Where along an equirectangular map the direction a.xyz lies, as atan has it.
#include "shared/constants.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return 0.5 + atan(a.x, -a.z) / (2.0 * PI);
}
