// The solid angle of a cone of half-angle a.x, as 4 pi sin^2(gamma / 2).
#include "shared/constants.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  float sine = sin(0.5 * a.x);
  return 4.0 * PI * sine * sine;
}
