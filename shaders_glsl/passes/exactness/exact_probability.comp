// P(i, o, gamma) of a list of questions, by the rung that is included; a row of answers for each row of groups.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "probability.glsl"

layout(local_size_x = 64) in;

// Directions are unit vectors about n = +Z.
struct ProbabilityQuestion {
  vec3 i; // Towards the light.
  float alpha; // Roughness.
  vec3 o; // Towards the viewer.
  float sin2_half_gamma; // sin^2 of half the cone's half-angle.
};

layout(std430, binding = 30) readonly buffer ProbabilityQuestions { ProbabilityQuestion questions[]; };
layout(std430, binding = 40) writeonly buffer Answers { float answers[]; };
layout(push_constant) uniform Params {
  uint count; // Questions.
  uint unread; // 0. Bits of the question that change the answer, so that no rung is spared reading all of it.
};

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= count) {
    return;
  }
  ProbabilityQuestion question = questions[index];
  float lit = probability(question.i, question.o, question.sin2_half_gamma, question.alpha);
  uvec3 read = floatBitsToUint(question.i) ^ floatBitsToUint(question.o);
  uint rest = floatBitsToUint(question.alpha) ^ floatBitsToUint(question.sin2_half_gamma);
  uint changed = unread & (read.x ^ read.y ^ read.z ^ rest);
  answers[gl_WorkGroupID.y * count + index] = uintBitsToFloat(floatBitsToUint(lit) ^ changed);
}
