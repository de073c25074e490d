// Counts the flakes of footprints, and those that are lit.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/flakes_in_footprint.glsl"

layout(local_size_x = 64) in;

struct Query {
  float uv[2]; // In the middle of the footprint.
  float side_x[2];
  float side_y[2];
  float i[3];
  float o[3];
  uint sin2_half_gamma[2]; // As f64: low and high word.
};

struct Answer {
  uint inside;
  uint lit;
  uint steps; // Taken in all passes,
  float allowed; // and what `flake_walk_steps` allows.
  int next[2];
  uint over; // 1 once the walk is.
  uint passes;
};

layout(std430, binding = 30) readonly buffer Queries { Query queries[]; };
layout(std430, binding = 31) buffer Answers { Answer answers[]; };
layout(push_constant) uniform Params {
  uint seed;
  uint leaf_level;
  uint table_level;
  float flakes;
  float slope_deviation;
  uint steps; // In this pass.
};

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= queries.length()) {
    return;
  }
  Query query = queries[index];
  Answer answer = answers[index];
  FlakeSet set = FlakeSet(leaf_level, table_level, seed);
  vec2 uv = vec2(query.uv[0], query.uv[1]);
  vec2 side_x = vec2(query.side_x[0], query.side_x[1]);
  vec2 side_y = vec2(query.side_y[0], query.side_y[1]);
  vec3 i = vec3(query.i[0], query.i[1], query.i[2]);
  vec3 o = vec3(query.o[0], query.o[1], query.o[2]);
  double sin2_half_gamma = packDouble2x32(uvec2(query.sin2_half_gamma[0], query.sin2_half_gamma[1]));
  FlakeWalk walk = start_flake_walk(set, footprint_corner(uv, side_x, side_y), side_x, side_y);
  if (answer.passes > 0u) {
    resume_flake_walk(walk, ivec2(answer.next[0], answer.next[1]));
  }
  int steps_left = answer.over != 0u ? 0 : int(steps);
  while (steps_left > 0 && !flake_walk_is_over(walk)) {
    int taken = next_flake_leaf(set, walk);
    LeafCross leaf_x = leaf_cross(walk, walk.across_x, walk.corner_x);
    LeafCross leaf_y = leaf_cross(walk, walk.across_y, walk.corner_y);
    for (uint flake = 0u; flake < walk.flakes; ++flake) {
      ++taken;
      if (flake_is_inside(walk, leaf_x, leaf_y, flake)) {
        ++answer.inside;
        vec3 normal = flake_normal(walk.leaf, flake, slope_deviation);
        answer.lit += flake_is_lit(normal, i, o, sin2_half_gamma) ? 1u : 0u;
      }
    }
    steps_left -= taken;
    answer.steps += uint(taken);
  }
  answer.next = int[](walk.next.x, walk.next.y);
  answer.over = flake_walk_is_over(walk) ? 1u : 0u;
  answer.allowed = flake_walk_steps(set, side_x, side_y, flakes, 0.0);
  ++answer.passes;
  answers[index] = answer;
}
