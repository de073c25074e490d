// Adds numbers to sums of two words in memory, in the order in which invocations come to them.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/fixed_point_sum.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 30) readonly buffer Asked { float asked[]; };
layout(std430, binding = 40) buffer Total { uint total[]; };
layout(push_constant) uniform Params {
  uint count; // Of the list.
  uint sums; // That it is dealt to in turn.
};

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= count) {
    return;
  }
  float x = asked[index];
  uint sum = index % sums;
  ADD_FIXED_POINT(total[2u * sum], total[2u * sum + 1u], x);
}
