// Counted flakes as probabilities.
#version 460
#extension GL_GOOGLE_include_directive : require

layout(local_size_x = 64) in;
layout(std430, binding = 30) readonly buffer Hits { uint hits[]; };
layout(std430, binding = 40) writeonly buffer Dpf { float dpf[]; };
layout(push_constant) uniform Params {
  uint entries; // In all tables.
  float flakes; // Flakes counted for each.
};

void main() {
  // Rows of groups, as one row alone may not hold them all.
  uint index = gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x + gl_GlobalInvocationID.x;
  if (index < entries) {
    dpf[index] = float(hits[index]) / flakes;
  }
}
