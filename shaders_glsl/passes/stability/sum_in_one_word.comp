// Adds numbers to sums of one word in memory, as multiples of 2^-20 without a carry.
#version 460
#extension GL_GOOGLE_include_directive : require

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
  atomicAdd(total[sum], uint(x * 1048576.0));
}
