// One function of words, by the rung that is included: what a device makes of bits, bit for bit.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "bits.glsl"

layout(local_size_x = 64) in;

// Each rung says what it takes them for.
struct Words {
  uvec4 a;
  uvec4 b;
};

layout(std430, binding = 30) readonly buffer WordList { Words words[]; };
layout(std430, binding = 40) writeonly buffer Answers { uvec4 answers[]; };
layout(push_constant) uniform Params {
  uint count; // Of the list.
};

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= count) {
    return;
  }
  Words of = words[index];
  answers[index] = answer(of.a, of.b);
}
