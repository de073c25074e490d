// Which triangle of which instance is seen through each pixel; holes and back faces are left out.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/materials.glsl"

layout(location = 0) flat in uvec2 seen;
layout(location = 1) in vec2 uv;
layout(location = 2) in float coverage;
layout(location = 0) out uvec2 ids; // Instance plus 1, seen.

void main() {
  Instance instance = instances[seen.x];
  Material material = materials[instance.material];
  bool mirrored = (instance.flags & INSTANCE_MIRRORED) != 0u;
  if ((material.flags & MATERIAL_DOUBLE_SIDED) == 0u && gl_FrontFacing == mirrored) {
    discard;
  }
  if ((material.flags & MATERIAL_ALPHA_MASK) != 0u) {
    float alpha = coverage;
    // The base colour is the first of the textures, if it is there. A loop, as some drivers execute branches always.
    bool textured = material.texture_count > 0u && material.textures[0].slot_and_set >> 1 == TEXTURE_BASE_COLOR;
    for (uint index = 0u; index < (textured ? 1u : 0u); ++index) {
      // The finest level: holes stay where the artist drew them.
      alpha *= sample_texture(material.textures[index], uv, vec2(0.0), vec2(0.0)).a;
    }
    if (alpha < material.surface.w) {
      discard;
    }
  }
  ids = uvec2(seen.x + 1u, seen.y);
}
