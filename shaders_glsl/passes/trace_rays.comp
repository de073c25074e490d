// Asks the scene's occluders about each ray of a list.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/ray_counts.glsl"
#include "shared/ray_offset.glsl"
#include "occlusion.glsl"

layout(local_size_x = 64) in;

struct Ray {
  vec3 origin; // In scene space.
  float t_min; // Not negative.
  vec3 direction; // Of any length.
  float t_max;
  vec3 normal; // Unless 0, the origin is first moved off the surface along it, as every pass does.
  float reach; // Of that surface, as triangle_reach has it. 0 where it is not known: a quarter of the scene's size.
};

struct RayAnswer {
  float t; // Of the closest hit, in lengths of the direction; 0 where only any hit was asked for.
  uint blocked; // 1 where something is hit.
  uint instance; // Of the closest hit.
  uint triangle; // Of the closest hit, in the list of its mesh.
  vec2 barycentrics; // Weights of its second and third corner.
};

layout(push_constant) uniform Params {
  uint count; // Rays.
  uint closest; // 1 asks for the closest hit, 0 for any.
  float scene_unit; // The power of two that the scene fits into: its largest coordinate in scene space is no larger.
} params;

layout(std430, binding = 30) readonly buffer Rays { Ray rays[]; };
layout(std430, binding = 40) writeonly buffer RayAnswers { RayAnswer answers[]; };

void main() {
  // Rows of a dispatch, each as long as Vulkan grants every device. No buffer holds 2^32 rays.
  uint index = gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x + gl_GlobalInvocationID.x;
  if (index < params.count) {
    Ray ray = rays[index];
    float reach = ray.reach > 0.0 ? ray.reach : 0.25 * params.scene_unit;
    vec3 origin = ray.normal == vec3(0.0) ? ray.origin : offset_origin(ray.origin, ray.normal, reach);
    RayHit hit = RayHit(0.0, 0u, 0u, vec2(0.0));
    bool blocked = params.closest != 0u
      ? closest_hit(origin, ray.direction, ray.t_min, ray.t_max, hit)
      : occluded(origin, ray.direction, ray.t_min, ray.t_max);
    answers[index] = RayAnswer(hit.t, uint(blocked), hit.instance, hit.triangle, hit.barycentrics);
  }
  count_rays();
}
