// Parts the flakes of each node of one level of the quadtree among its four children (engine/design/0007-flake-set.md).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/flake_set.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Parents { uvec2 parents[]; }; // Low and high word, row by row.
layout(std430, binding = 1) writeonly buffer Children { uvec2 children[]; }; // Of the next level.
layout(push_constant) uniform Params {
  uint level; // Of the parents.
  uint seed; // Of the flakes.
};

uvec2 words(uint64_t count) {
  return uvec2(uint(count & 0xffffffffUL), uint(count >> 32));
}

void main() {
  uint node = gl_GlobalInvocationID.x;
  if (node >> (2u * level) != 0u) {
    return;
  }
  uvec2 place = uvec2(node & ((1u << level) - 1u), node >> level);
  uvec2 count = parents[node];
  uint64_t flakes = uint64_t(count.x) | uint64_t(count.y) << 32;
  u64vec4 parts = children_of(flakes, node_key(level, place.x, place.y, seed));
  uint row = 2u << level;
  uint first = 2u * place.y * row + 2u * place.x;
  children[first] = words(parts.x);
  children[first + 1u] = words(parts.y);
  children[first + row] = words(parts.z);
  children[first + row + 1u] = words(parts.w);
}
