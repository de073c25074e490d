// A column of the frame about the unit normal a, by the renderer's own function: the b.x-th, 0 to 2.
#include "shared/directions.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  mat3 frame = frame_about(uintBitsToFloat(a.xyz));
  return uvec4(floatBitsToUint(b.x == 0u ? frame[0] : b.x == 1u ? frame[1] : frame[2]), 0u);
}
