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
