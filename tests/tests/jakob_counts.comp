// Answers queries of the tree of Jakob et al. 2014: how many flakes of a footprint are lit.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/jakob_tree.glsl"

layout(local_size_x = 64) in;

struct Query {
  vec2 corner;
  vec2 side_x;
  vec2 side_y;
  uint seed;
  uint mode;
  vec3 i;
  float sin_half;
  vec3 o;
  float cos_half;
  uint flakes_low;
  uint flakes_high;
  uint last_level;
  float split_ratio;
  float epsilon;
  int budget;
  uint reserved[2];
};

struct Answer {
  uint counted_low;
  uint counted_high;
  float expected;
  int steps; // That it took.
};

layout(std430, binding = 30) readonly buffer Queries { Query queries[]; };
layout(std430, binding = 31) writeonly buffer Answers { Answer answers[]; };

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= queries.length()) {
    return;
  }
  Query query = queries[index];
  uint64_t flakes = uint64_t(query.flakes_high) << 32 | uint64_t(query.flakes_low);
  JakobTree tree = JakobTree(flakes, query.seed, query.last_level, query.split_ratio, query.epsilon);
  JakobFootprint footprint = jakob_footprint(flakes, query.corner, query.side_x, query.side_y);
  JakobCone cone = JakobCone(query.i, query.o, query.sin_half, query.cos_half);
  int before = steps_left;
  JakobCount found = jakob_count(tree, footprint, cone, query.mode, query.budget);
  answers[index] =
    Answer(uint(found.counted), uint(found.counted >> 32), found.expected, before - steps_left);
}
