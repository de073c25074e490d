// Adds numbers to one number of two words in memory, in the order in which invocations come to it.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/fixed_point_sum.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 30) readonly buffer Asked { float asked[]; };
layout(std430, binding = 40) buffer Total { uint total[]; };

void main() {
  float x = asked[gl_GlobalInvocationID.x];
  ADD_FIXED_POINT(total[0], total[1], x);
}
