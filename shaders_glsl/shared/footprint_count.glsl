// How many flakes a footprint holds, as a filter of some shape counts them: the walk that every filter shares.
//
// A filter gives the parallelogram outside of which it sees nothing, and the weight of each flake inside. Weights are such
// that their integral over texture space is the area of the pixel's own parallelogram, so that all filters count as many
// flakes on average. Needs shaderInt64 and shaderFloat64.
#ifndef FOOTPRINT_COUNT_GLSL
#define FOOTPRINT_COUNT_GLSL
#include "shared/flakes_in_footprint.glsl"
#include "shared/footprint_area.glsl"

// The parallelogram of a pixel: its centre, and its sides.
struct AskedFootprint {
  vec2 uv; // Centre.
  vec2 side_x; // Change from pixel to pixel along x,
  vec2 side_y; // and along y.
};

layout(std430, binding = 30) readonly buffer Footprints { AskedFootprint footprints[]; };
layout(std430, binding = 40) writeonly buffer Counts { float counts[]; };

// What a filter looks at: corner + a side_x + b side_y, 0 <= a, b < 1.
struct Reach {
  vec2 side_x;
  vec2 side_y;
};

// What the filter of this footprint may see.
Reach filter_reach(AskedFootprint footprint);

// Called once for each leaf before its flakes.
void filter_enters(FlakeWalk walk);

// Weight of a flake of the leaf that was entered.
float filter_weight(FlakeWalk walk, uint flake);

// A flake's place from the corner that the walk started at, in units of texture.
vec2 flake_offset(FlakeSet set, FlakeWalk walk, uint flake) {
  dvec2 place = dvec2(walk.at) + (dvec2(flake_place(walk.leaf, flake)) + 0.5lf) * (1.0lf / 4294967296.0lf);
  return vec2((place - walk.corner) / double(1u << set.leaf_level));
}

FlakeSet counted_set;

float counted_flakes(AskedFootprint footprint) {
  Reach reach = filter_reach(footprint);
  dvec2 corner = footprint_corner(footprint.uv, reach.side_x, reach.side_y);
  FlakeWalk walk = start_flake_walk(counted_set, corner, reach.side_x, reach.side_y);
  int steps_left = FLAKE_STEPS_A_PASS;
  float sum = 0.0;
  while (steps_left > 0 && !flake_walk_is_over(walk)) {
    steps_left -= next_flake_leaf(counted_set, walk);
    filter_enters(walk);
    for (uint flake = 0u; flake < walk.flakes; ++flake) {
      --steps_left;
      sum += filter_weight(walk, flake);
    }
  }
  return sum;
}

float footprint_area(AskedFootprint footprint) {
  return footprint_area(footprint.side_x, footprint.side_y);
}

#endif
