// Splits the flakes of one level of the quadtree among the children, each node by its own random numbers.
//
// Jakob et al. 2014, section 5.2: fewer than 8 flakes are dealt one by one; more by a Gaussian with the multinomial's
// covariance, repaired to the right sum below 1000. Wang, Deng and Holzschuch 2020, section 5.1: a 1-D buffer of two
// float4 a node, (id, count, depth, number of children) and the bounds; they lie in two buffers here, as one alone would
// pass the guaranteed range of 128 MiB.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/constants.glsl"
#include "shared/hash.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 40) buffer Nodes { vec4 nodes[]; };
layout(std430, binding = 41) buffer Bounds { vec4 bounds[]; };
layout(push_constant) uniform Params {
  uint level; // Of the nodes that are split; their children lie on the next.
  uint depth; // Level of the leaves.
  float flakes; // At the root.
  uint seed; // Of the flakes.
};

vec2 two_gaussians(uvec2 bits) {
  float radius = sqrt(-2.0 * log(unit_from(bits.x)));
  float angle = 2.0 * PI * unit_from(bits.y);
  return radius * vec2(cos(angle), sin(angle));
}

void main() {
  uint index = gl_GlobalInvocationID.x;
  uint level_size = 1u << (2u * level);
  if (index >= level_size) {
    return;
  }
  uint at = (level_size - 1u) / 3u + index;
  if (level == 0u) {
    nodes[0] = vec4(0.0, flakes, 0.0, depth > 0u ? 4.0 : 0.0);
    bounds[0] = vec4(0.0, 0.0, 1.0, 1.0);
  }
  float n = nodes[at].y;
  vec4 box = bounds[at];
  vec4 counts = vec4(0.0);
  uvec2 random = tea(uvec2(at, seed));
  if (n < 8.0) {
    for (int flake = 0; flake < int(n); ++flake) {
      counts[random.x >> (30 - 2 * flake) & 3u] += 1.0;
    }
  } else {
    vec2 first = two_gaussians(random);
    vec2 second = two_gaussians(tea(random));
    float d0 = sqrt(n * 3.0 / 16.0) * first.x;
    float d1 = sqrt(n / 6.0) * first.y;
    float d2 = sqrt(n / 8.0) * second.x;
    vec4 deviation = vec4(d0, d1 - d0 / 3.0, d2 - d1 / 2.0 - d0 / 3.0, -d2 - d1 / 2.0 - d0 / 3.0);
    counts = max(floor(0.25 * n + deviation + 0.5), 0.0);
    if (n < 1000.0) {
      float missing = n - (counts.x + counts.y + counts.z + counts.w);
      uint bits = random.x;
      for (int step = 0; step < 256 && missing != 0.0; ++step) {
        bits = mixed(bits + 1u);
        uint child = bits >> 30;
        float change = sign(missing);
        if (counts[child] + change >= 0.0) {
          counts[child] += change;
          missing -= change;
        }
      }
    }
  }
  vec2 middle = 0.5 * (box.xy + box.zw);
  uint first_child = (4u * level_size - 1u) / 3u + 4u * index;
  for (uint child = 0u; child < 4u; ++child) {
    vec2 corner = vec2((child & 1u) == 0u ? box.x : middle.x, (child & 2u) == 0u ? box.y : middle.y);
    uint id = first_child + child;
    nodes[id] = vec4(float(id), counts[child], float(level + 1u), level + 1u < depth ? 4.0 : 0.0);
    bounds[id] = vec4(corner, corner + middle - box.xy);
  }
}
