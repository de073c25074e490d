// The solid angle of a cone of half-angle a.x, as 2 pi (1 - cos gamma).
#include "shared/constants.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return 2.0 * PI * (1.0 - cos(a.x));
}
