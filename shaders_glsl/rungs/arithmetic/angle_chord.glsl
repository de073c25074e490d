// The angle between two directions, from the chord.
#include "shared/angles.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return angle_between(a.xyz, b.xyz);
}
