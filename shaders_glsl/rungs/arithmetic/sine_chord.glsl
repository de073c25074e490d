// The sine of the angle between two directions, from their chords.
#include "shared/angles.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return sine_between(a.xyz, b.xyz);
}
