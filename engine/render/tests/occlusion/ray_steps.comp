// Asks about each ray of a list for the closest hit and then for any, and says what became of the invocation's steps.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "occlusion.glsl"

layout(local_size_x = 64) in;

struct Ray { // As in passes/trace_rays.comp.
  vec3 origin;
  float t_min;
  vec3 direction;
  float t_max;
  vec3 normal;
  uint reserved;
};

struct Steps {
  float t; // Of the closest hit.
  uint triangle;
  uint closest; // 1 where the closest hit was found.
  uint any; // 1 where any hit was found.
  uint cut_short; // How many of the two ran out of steps.
  uint left; // Of the invocation, after both.
};

layout(std430, binding = 30) readonly buffer Rays { Ray rays[]; };
layout(std430, binding = 40) writeonly buffer AllSteps { Steps all_steps[]; };

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= rays.length()) {
    return;
  }
  Ray ray = rays[index];
  RayHit hit;
  bool closest = closest_hit(ray.origin, ray.direction, ray.t_min, ray.t_max, hit);
  bool any = occluded(ray.origin, ray.direction, ray.t_min, ray.t_max);
  all_steps[index] = Steps(hit.t, hit.triangle, uint(closest), uint(any), rays_cut_short, bvh_steps_left);
}
