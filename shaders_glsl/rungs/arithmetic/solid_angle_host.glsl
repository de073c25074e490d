// The solid angle of a cone, as 4 pi sin^2(gamma / 2) with the square a.y from the host.
#include "shared/constants.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return 4.0 * PI * a.y;
}
