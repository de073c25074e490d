// Where along an equirectangular map the direction a.xyz lies, with a rule for straight up and down.
#include "shared/equirect.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return equirect_from(a.xyz).x;
}
