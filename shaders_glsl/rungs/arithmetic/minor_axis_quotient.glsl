// Half the shorter axis of the ellipse with the sides a.xy and a.zw, as area over the longer.
#include "shared/footprint_ellipse.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  return footprint_axes(a.xy, a.zw).y;
}
