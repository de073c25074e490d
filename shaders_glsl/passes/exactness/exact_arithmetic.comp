// One formula of a list of numbers, by the rung that is included; many times over when it is timed, as
// one evaluation takes less than reading the numbers.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "arithmetic.glsl"

layout(local_size_x = 64) in;

// Each rung says what it takes them for.
struct Operands {
  vec4 a;
  vec4 b;
  vec4 c;
};

layout(std430, binding = 30) readonly buffer OperandList { Operands operands[]; };
layout(std430, binding = 40) writeonly buffer Answers { float answers[]; };
layout(push_constant) uniform Params {
  uint count; // Of the list.
  uint evaluations; // Of each: each a little different, so that none can be spared; the first is the question itself.
};

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= count) {
    return;
  }
  Operands of = operands[index];
  float sum = 0.0;
  for (uint k = 0u; k < evaluations; ++k) {
    float scale = 1.0 + float(k) * (1.0 / 8388608.0);
    sum += value(scale * of.a, scale * of.b, scale * of.c);
  }
  answers[gl_WorkGroupID.y * count + index] = sum;
}
