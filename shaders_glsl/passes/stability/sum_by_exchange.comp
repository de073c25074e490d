// Adds numbers to floats in memory, in the order in which invocations come to them.
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;
layout(std430, binding = 30) readonly buffer Asked { float asked[]; };
layout(std430, binding = 40) coherent buffer Total { uint total[]; };
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
  uint before = total[sum];
  for (int tries = 0; tries < 1000; ++tries) {
    uint found = atomicCompSwap(total[sum], before, floatBitsToUint(uintBitsToFloat(before) + x));
    if (found == before) {
      break;
    }
    before = found;
  }
}
