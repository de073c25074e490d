// Counts rays in groups of 32 invocations.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/ray_counts.glsl"

layout(local_size_x = 32) in;
layout(std430, binding = 30) readonly buffer Asked { uint asked[]; };

void main() {
  rays_traced = asked[gl_GlobalInvocationID.x];
  rays_cut_short = rays_traced & 1u;
  count_rays();
}
