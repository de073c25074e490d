// The distance that stands for the level a.x of Wang and Bowles's grid, where the formula is 0 that of the next.
#include "shared/sparkle_grid.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return sparkle_distance(int(a.x));
}
