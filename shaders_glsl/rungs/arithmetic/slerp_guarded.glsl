// The point at the fraction a.w of the arc from a to b, along c, by chords.
#include "shared/area_lights.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return dot(slerp(a.xyz, b.xyz, a.w), c.xyz);
}
