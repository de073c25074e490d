// The chance of any success, through log(1 - p) and 1 - exp by series; a.x is n, a.y is p.
#include "shared/chances.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return chance_of_any(a.x, a.y);
}
