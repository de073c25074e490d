// The flakes of a node's four children, a quarter each, cut to whole ones.
//
// a is a node's count of flakes (low and high word) and its place; b is its level,
// the seed, which word of each count is asked for, and when the node was split.
#include "shared/flake_set.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  uint64_t flakes = uint64_t(a.x) | uint64_t(a.y) << 32;
  uint64_t each = flakes >> 2;
  return uvec4(uint(b.z == 0u ? each & 0xffffffffUL : each >> 32));
}
