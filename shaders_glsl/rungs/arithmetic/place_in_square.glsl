// Where in its square of texture a point of a triangle lies: corners a.xyz, weights b.xy of the last two.
#include "shared/cells.glsl"
#include "shared/texture_place.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  vec2 place = texture_place(vec2(a.x), vec2(a.y), vec2(a.z), b.xy, true);
  return within_cell(place).x;
}
