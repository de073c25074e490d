// The flakes of a node's four children by normal numbers in floats: Jakob et al. 2014, section 5.2, without its repair
// below 1000.
//
// a is a node's count of flakes (low and high word) and its place; b is its level,
// the seed, which word of each count is asked for, and when the node was split.
#include "shared/flake_set.glsl"

uvec4 answer(uvec4 a, uvec4 b) {
  float n = float(uint64_t(a.x) | uint64_t(a.y) << 32);
  uvec2 key = node_key(b.x, a.z, a.w, b.y);
  vec2 first = normal_pair(draw(key, 0u), draw(key, 1u));
  vec2 second = normal_pair(draw(key, 2u), draw(key, 3u));
  float d0 = sqrt(n * 3.0 / 16.0) * first.x;
  float d1 = sqrt(n / 6.0) * first.y;
  float d2 = sqrt(n / 8.0) * second.x;
  vec4 deviation = vec4(d0, d1 - d0 / 3.0, d2 - d1 / 2.0 - d0 / 3.0, -d2 - d1 / 2.0 - d0 / 3.0);
  vec4 counts = max(floor(0.25 * n + deviation + 0.5), 0.0);
  u64vec4 children = u64vec4(uint64_t(counts.x), uint64_t(counts.y), uint64_t(counts.z), uint64_t(counts.w));
  return uvec4(b.z == 0u ? children & u64vec4(0xffffffffUL) : children >> 32);
}
