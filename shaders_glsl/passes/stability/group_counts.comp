// Counts rays in groups of the shape that is included. Edges cut groups, and every invocation takes as many rounds as its
// number says.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "group.glsl"
#include "shared/ray_counts.glsl"

layout(std430, binding = 30) readonly buffer Asked { uint asked[]; };
layout(push_constant) uniform Params {
  uint width; // Of the dispatch, in invocations.
  uint count; // Of the list.
  uint rays; // That every ray stands for.
};

void main() {
  uint index = gl_GlobalInvocationID.y * width + gl_GlobalInvocationID.x;
  uint rest = gl_GlobalInvocationID.x < width && index < count ? asked[index] : 0u;
  // No closed form: each round is run.
  for (uint rounds = rest % 48u; rounds > 0u; --rounds) {
    rest = rest * 1664525u + 1013904223u;
    rays_traced += (rest >> 31) * rays;
    rays_cut_short += (rest >> 30 & 1u) * rays;
  }
  count_rays();
}
