// Traces each ray of a buffer twice: for any hit and for the closest.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "occlusion/bvh.glsl"
#include "shared/ray_offset.glsl"

layout(local_size_x = 64) in;

struct Ray {
  vec3 origin;
  float t_min;
  vec3 direction;
  float t_max;
  vec3 normal; // Unless 0, the origin is moved off the surface along it.
  float scene_unit; // As in Frame.
};

struct Answer {
  float t;
  uint instance;
  uint triangle;
  uint closest; // 1 where the closest hit was found.
  vec2 barycentrics;
  uint any; // 1 where any hit was found.
  uint steps_left; // Of the invocation, after both.
  uint cut_short; // How many of the two ran out of steps.
  uint reserved;
};

layout(std430, binding = 30) readonly buffer Rays { Ray rays[]; };
layout(std430, binding = 31) writeonly buffer Answers { Answer answers[]; };

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= rays.length()) {
    return;
  }
  Ray ray = rays[index];
  vec3 origin = ray.normal == vec3(0.0) ? ray.origin : offset_origin(ray.origin, ray.normal, ray.scene_unit);
  RayHit hit;
  bool closest = closest_hit(origin, ray.direction, ray.t_min, ray.t_max, hit);
  bool any = occluded(origin, ray.direction, ray.t_min, ray.t_max);
  answers[index] = Answer(
    hit.t, hit.instance, hit.triangle, uint(closest), hit.barycentrics, uint(any), bvh_steps_left, rays_cut_short, 0u
  );
}
