// How far a frame about a.xyz is from orthonormal, its side by a comparison, which takes -0 as 0.
#include "shared/directions.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  mat3 from_local = frame_about(a.xyz);
  mat3 error = transpose(from_local) * from_local - mat3(1.0);
  return max(length(error[0]), max(length(error[1]), length(error[2])));
}
