// How many rays a pass traced, for the report.
#ifndef RAY_COUNTS_GLSL
#define RAY_COUNTS_GLSL
#include "shared/rays.glsl"

layout(std430, binding = 27) buffer RayCounts {
  uint traced; // Rays; 2^32 - 1 stands for that many or more.
  uint cut_short; // Those of them that ran out of steps, counted alike.
} ray_counts;

shared uint group_traced;
shared uint group_cut_short;

// Adds this invocation's rays. Every invocation of the group calls it, once, at the end: one atomic operation a group
// reaches memory, as one a pixel would cost as much as a short ray.
void count_rays() {
  if (gl_LocalInvocationIndex == 0u) {
    group_traced = 0u;
    group_cut_short = 0u;
  }
  barrier();
  atomicAdd(group_traced, rays_traced);
  atomicAdd(group_cut_short, rays_cut_short);
  barrier();
  if (gl_LocalInvocationIndex == 0u) {
    // 32 lights on the largest of images pass 2^32. Whoever carries the count past its end leaves it there.
    if (atomicAdd(ray_counts.traced, group_traced) > ~group_traced) {
      atomicMax(ray_counts.traced, 0xffffffffu);
    }
    if (atomicAdd(ray_counts.cut_short, group_cut_short) > ~group_cut_short) {
      atomicMax(ray_counts.cut_short, 0xffffffffu);
    }
  }
}

#endif
