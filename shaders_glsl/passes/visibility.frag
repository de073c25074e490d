// Which triangle of which instance is seen through each pixel; holes and back faces are left out.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/alpha_mask.glsl"

layout(location = 0) flat in uvec2 seen; // Instance, triangle.
layout(location = 1) in vec2 barycentrics; // Weights of the second and third corner.
layout(location = 0) out uvec2 ids; // Instance plus 1, triangle.

void main() {
  // The back of a single-sided surface is not seen, but it blocks light: else a roof of one sheet would let in what
  // shines on its back, and a wall would cast no shadow into its room.
  bool mirrored = (instances[seen.x].flags & INSTANCE_MIRRORED) != 0u;
  bool double_sided = (materials[instances[seen.x].material].flags & MATERIAL_DOUBLE_SIDED) != 0u;
  bool back = gl_FrontFacing == mirrored;
  if ((back && !double_sided) || !is_covered(seen.x, seen.y, barycentrics)) {
    discard;
  }
  ids = uvec2(seen.x + 1u, seen.y);
}
