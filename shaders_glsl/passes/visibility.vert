// Which triangle of which instance is seen through each pixel.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/frame.glsl"
#include "shared/scene.glsl"

layout(location = 0) flat out uvec2 seen; // Instance, triangle.
layout(location = 1) out vec2 barycentrics; // Weights of the second and third corner.

void main() {
  uint corner = uint(gl_VertexIndex) % 3u;
  Instance instance = instances[gl_InstanceIndex];
  seen = uvec2(uint(gl_InstanceIndex), uint(gl_VertexIndex) / 3u);
  barycentrics = vec2(corner == 1u, corner == 2u);
  uint vertex = indices[instance.first_index + 3u * seen.y + corner] + instance.first_vertex;
  gl_Position = frame.clip_from_scene * vec4(scene_point(instance, local_position(vertex)), 1.0);
}
