// A column of the frame of the unit normal a and the tangent b, by the renderer's own function: the a.w-th, 0 to 2.
#include "shared/directions.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  mat3 frame = frame_along(uintBitsToFloat(a.xyz), uintBitsToFloat(b.xyz), 1.0);
  return uvec4(floatBitsToUint(a.w == 0u ? frame[0] : a.w == 1u ? frame[1] : frame[2]), 0u);
}
