// The flakes of a node's four children. a is a node's count of flakes (low and high word) and its place; b is its level,
// the seed, which word of each count is asked for, and when the node was split.
#include "shared/flake_set.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  uint64_t flakes = uint64_t(a.x) | uint64_t(a.y) << 32;
  u64vec4 children = children_of(flakes, node_key(b.x, a.z, a.w, b.y));
  return uvec4(b.z == 0u ? children & u64vec4(0xffffffffUL) : children >> 32);
}
