// Adds up groups of 64 numbers as if 32 invocations always ran in step: no barrier from there on.
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;
layout(std430, binding = 30) readonly buffer Asked { uint asked[]; };
layout(std430, binding = 40) buffer Total { uint total[]; };

shared uint partial[64];

void main() {
  uint lane = gl_LocalInvocationIndex;
  partial[lane] = asked[gl_GlobalInvocationID.x];
  barrier();
  for (uint reach = 32u; reach > 0u; reach /= 2u) {
    if (lane < reach) {
      partial[lane] += partial[lane + reach];
    }
  }
  if (lane == 0u) {
    atomicAdd(total[0], partial[0]);
  }
}
