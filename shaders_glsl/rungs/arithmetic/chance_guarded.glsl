// The chance to choose the first of two parts that hold a.x and a.y, even where both hold nothing.
#include "shared/area_lights.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return chance_of_first(a.x, a.y);
}
