// How far down an equirectangular map the direction a.xyz lies, from its height alone.
#include "shared/constants.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return acos(a.y / length(a.xyz)) / PI;
}
