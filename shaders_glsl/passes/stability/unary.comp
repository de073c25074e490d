// A function of one word, by the rung that is included, for words at equal distances: no list of them is read.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "unary.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 40) writeonly buffer Answers { float answers[]; };
layout(push_constant) uniform Params {
  uint count; // Words.
  uint first; // The first of them.
  uint distance; // From one to the next.
};

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index < count) {
    answers[index] = helper(first + index * distance);
  }
}
