// Adds numbers to one float in memory, in the order in which invocations come to it.
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;
layout(std430, binding = 30) readonly buffer Asked { float asked[]; };
layout(std430, binding = 40) coherent buffer Total { uint total[]; };

void main() {
  float x = asked[gl_GlobalInvocationID.x];
  uint before = total[0];
  for (int tries = 0; tries < 1000; ++tries) {
    uint found = atomicCompSwap(total[0], before, floatBitsToUint(uintBitsToFloat(before) + x));
    if (found == before) {
      break;
    }
    before = found;
  }
}
