// Length of the view's shift of Wang and Bowles's grid less 1; a is the view, and a.w the distance that stands for the level.
#include "shared/sparkle_grid.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return length(sparkle_shift(a.xyz, a.w)) - 1.0;
}
