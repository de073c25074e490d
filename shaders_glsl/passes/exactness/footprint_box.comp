// Flakes in a box along the axes of texture space that stands for a pixel's parallelogram: the least box around it, or a
// square of its area.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/footprint_count.glsl"

layout(local_size_x = 64) in;
layout(push_constant) uniform Params {
  uint count; // Footprints.
  uint leaf_level; // Of the quadtree.
  uint table_level; // Of the table of counts.
  uint seed; // Of the flakes.
  uint square; // 1: a square of the same area; 0: the box around the parallelogram.
} params;

vec2 size; // Of the box.
float weight; // Of each flake in it.

Reach filter_reach(AskedFootprint footprint) {
  float area = footprint_area(footprint);
  size = params.square == 1u ? vec2(sqrt(area)) : abs(footprint.side_x) + abs(footprint.side_y);
  weight = area / (size.x * size.y);
  return Reach(vec2(size.x, 0.0), vec2(0.0, size.y));
}

void filter_enters(FlakeWalk walk) {}

float filter_weight(FlakeWalk walk, uint flake) {
  vec2 offset = flake_offset(counted_set, walk, flake);
  bool inside = all(greaterThanEqual(offset, vec2(0.0))) && all(lessThan(offset, size));
  return inside ? weight : 0.0;
}

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index < params.count) {
    counted_set = FlakeSet(params.leaf_level, params.table_level, params.seed);
    counts[index] = counted_flakes(footprints[index]);
  }
}
