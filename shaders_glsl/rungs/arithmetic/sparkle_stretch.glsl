// Stretch of Wang and Bowles's sparkles along the view a seen from the normal b, without a division by 0.
#include "shared/sparkle_grid.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return sparkle_stretch(dot(a.xyz, b.xyz), 0.0);
}
