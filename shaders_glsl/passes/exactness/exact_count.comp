// How many of n flakes are lit, by the rung that is included, for every law with every draw.
#version 460
#extension GL_GOOGLE_include_directive : require

// Random numbers. Each rung takes those that its method has at hand.
struct CountDraw {
  uint word; // All words being as likely.
  float uniform_number; // Inside (0, 1).
  float normal_number; // Of mean 0 and variance 1, independent of the uniform one.
};

#include "count.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 30) readonly buffer CountDraws { CountDraw draws[]; };
layout(std430, binding = 31) readonly buffer CountLaws { vec2 laws[]; }; // n and p.
layout(std430, binding = 40) writeonly buffer Answers { float answers[]; };
layout(push_constant) uniform Params {
  uint count_of_draws; // For each law.
  uint unread; // 0. Bits of the draw that change the answer, so that no rung is spared reading all of it.
};

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= count_of_draws) {
    return;
  }
  vec2 law = laws[gl_WorkGroupID.y];
  CountDraw random = draws[index];
  float lit = count(law.x, law.y, random);
  uint read = random.word ^ floatBitsToUint(random.uniform_number) ^ floatBitsToUint(random.normal_number);
  answers[gl_WorkGroupID.y * count_of_draws + index] = uintBitsToFloat(floatBitsToUint(lit) ^ (unread & read));
}
