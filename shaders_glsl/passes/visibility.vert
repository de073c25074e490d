// Which triangle of which instance is seen through each pixel.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/frame.glsl"
#include "shared/materials.glsl"

layout(location = 0) flat out uvec2 seen;
layout(location = 1) out vec2 uv;
layout(location = 2) out float coverage;

void main() {
  uint corner = uint(gl_VertexIndex) % 3u;
  Instance instance = instances[gl_InstanceIndex];
  seen = uvec2(uint(gl_InstanceIndex), uint(gl_VertexIndex) / 3u);
  uint vertex = indices[instance.first_index + 3u * seen.y + corner] + instance.first_vertex;
  gl_Position = frame.clip_from_scene * vec4(scene_point(instance, local_position(vertex)), 1.0);

  Material material = materials[instance.material];
  uv = vec2(0.0);
  coverage = material.base_color.a;
  if ((instance.flags & INSTANCE_HAS_UV) != 0u) {
    vec4 both = uvs[vertex];
    uv = (material.textures[0].slot_and_set & 1u) == 0u ? both.xy : both.zw;
  }
  if ((instance.flags & INSTANCE_HAS_COLORS) != 0u) {
    coverage *= colors[vertex].a;
  }
}
