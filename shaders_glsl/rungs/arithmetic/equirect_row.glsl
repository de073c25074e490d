// How far down an equirectangular map the direction a.xyz lies, from both of its parts.
#include "shared/equirect.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return equirect_from(a.xyz).y;
}
