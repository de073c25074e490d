// The scene's geometry and instances, as the host lays them out.
#ifndef SCENE_GLSL
#define SCENE_GLSL
#include "shared/constants.glsl"

struct Instance {
  vec4 scene_from_local[3]; // Rows of the affine transform.
  uint material; // Index of its material.
  uint first_index; // Where its triangles begin in `indices`.
  uint first_vertex; // Added to each index.
  uint flags; // INSTANCE_*.
};

layout(std430, binding = 1) readonly buffer Instances { Instance instances[]; };
layout(std430, binding = 2) readonly buffer Indices { uint indices[]; };
layout(std430, binding = 3) readonly buffer Positions { float positions[]; };

uvec3 triangle_vertices(Instance instance, uint triangle) {
  uint at = instance.first_index + 3u * triangle;
  return uvec3(indices[at], indices[at + 1u], indices[at + 2u]) + instance.first_vertex;
}

vec3 local_position(uint vertex) {
  return vec3(positions[3u * vertex], positions[3u * vertex + 1u], positions[3u * vertex + 2u]);
}

vec3 scene_point(Instance instance, vec3 local) {
  vec4 point = vec4(local, 1.0);
  return vec3(
    dot(instance.scene_from_local[0], point),
    dot(instance.scene_from_local[1], point),
    dot(instance.scene_from_local[2], point)
  );
}

// The numbers that points of a triangle are made of, in scene space: the largest sum, along any axis, of the magnitudes of the
// terms that scene_point adds up for a corner. In units of rounding (2^-24) of it, a corner is off by 5 along each axis: each
// term by its coefficient, a product and three sums. A point that is put together from such corners is off by 11, with the
// roundings of two sides (2), their products (2) and two sums (2). However far off the eye is that finds it there: what goes
// wrong on the way moves it within the triangle. Corners on different axes may sum up to 3 times as much together as each
// does; that buys two of three transforms.
float triangle_reach(Instance instance, uint triangle) {
  uvec3 corners = triangle_vertices(instance, triangle);
  vec3 a = abs(local_position(corners.x));
  vec3 b = abs(local_position(corners.y));
  vec3 c = abs(local_position(corners.z));
  vec4 farthest = vec4(max(a, max(b, c)), 1.0);
  return max(
    dot(abs(instance.scene_from_local[0]), farthest),
    max(dot(abs(instance.scene_from_local[1]), farthest), dot(abs(instance.scene_from_local[2]), farthest))
  );
}

vec3 scene_vector(Instance instance, vec3 local) {
  return vec3(
    dot(instance.scene_from_local[0].xyz, local),
    dot(instance.scene_from_local[1].xyz, local),
    dot(instance.scene_from_local[2].xyz, local)
  );
}

// The cofactors carry normals without an inverse; the handedness is restored by the caller's flag.
vec3 scene_normal(Instance instance, vec3 local) {
  vec3 x = instance.scene_from_local[0].xyz;
  vec3 y = instance.scene_from_local[1].xyz;
  vec3 z = instance.scene_from_local[2].xyz;
  vec3 normal = vec3(dot(cross(y, z), local), dot(cross(z, x), local), dot(cross(x, y), local));
  return (instance.flags & INSTANCE_MIRRORED) != 0u ? -normal : normal;
}

#endif
