// Flakes in a pixel's very parallelogram, edges decided as if without rounding: what `flakes` shows.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/footprint_count.glsl"

layout(local_size_x = 64) in;
layout(push_constant) uniform Params {
  uint count; // Footprints.
  uint leaf_level; // Of the quadtree.
  uint table_level; // Of the table of counts.
  uint seed; // Of the flakes.
} params;

LeafCross leaf_x;
LeafCross leaf_y;

Reach filter_reach(AskedFootprint footprint) {
  return Reach(footprint.side_x, footprint.side_y);
}

void filter_enters(FlakeWalk walk) {
  leaf_x = leaf_cross(walk, walk.across_x, walk.corner_x);
  leaf_y = leaf_cross(walk, walk.across_y, walk.corner_y);
}

float filter_weight(FlakeWalk walk, uint flake) {
  return flake_is_inside(walk, leaf_x, leaf_y, flake) ? 1.0 : 0.0;
}

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index < params.count) {
    counted_set = FlakeSet(params.leaf_level, params.table_level, params.seed);
    counts[index] = counted_flakes(footprints[index]);
  }
}
