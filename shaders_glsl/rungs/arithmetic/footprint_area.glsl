// The area between the sides a.xy and a.zw, from products without error.
#include "shared/footprint_area.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return footprint_area(a.xy, a.zw);
}
