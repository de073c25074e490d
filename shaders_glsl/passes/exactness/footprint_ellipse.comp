// Flakes under an elliptical Gaussian that stands for a pixel's parallelogram (Heckbert 1989, "elliptical weighted average"),
// as Chermain et al. 2020 filter: e^(-2 r^2) - e^-2 within r < 1, r = 1 one pixel from the centre; a footprint longer than
// `max_anisotropy` times its width is widened to that.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/footprint_count.glsl"

layout(local_size_x = 64) in;
layout(push_constant) uniform Params {
  uint count; // Footprints.
  uint leaf_level; // Of the quadtree.
  uint table_level; // Of the table of counts.
  uint seed; // Of the flakes.
  float max_anisotropy; // Longer side over shorter, at most.
} params;

const float EDGE_WEIGHT = 0.1353352832366127; // e^-2, the Gaussian at r = 1.
const float INTEGRAL = 0.9330541; // pi/2 (1 - 3 e^-2): of the weights over the unit disk.

mat2 inverse_sides; // From texture space to pixels.
vec2 reach_x; // Sides of the parallelogram about the ellipse.
vec2 reach_y;
float scale; // Of the weights.

Reach filter_reach(AskedFootprint footprint) {
  vec2 major = footprint.side_x;
  vec2 minor = footprint.side_y;
  if (dot(major, major) < dot(minor, minor)) {
    major = footprint.side_y;
    minor = footprint.side_x;
  }
  float longer = length(major);
  float shorter = length(minor);
  minor *= max(longer / (shorter * params.max_anisotropy), 1.0);
  inverse_sides = inverse(mat2(major, minor));
  float widened = abs(major.x * minor.y - major.y * minor.x);
  scale = footprint_area(footprint) / (INTEGRAL * widened);
  reach_x = 2.0 * major;
  reach_y = 2.0 * minor;
  return Reach(reach_x, reach_y);
}

void filter_enters(FlakeWalk walk) {}

float filter_weight(FlakeWalk walk, uint flake) {
  vec2 from_centre = flake_offset(counted_set, walk, flake) - 0.5 * (reach_x + reach_y);
  vec2 pixels = inverse_sides * from_centre;
  return scale * max(exp(-2.0 * dot(pixels, pixels)) - EDGE_WEIGHT, 0.0);
}

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index < params.count) {
    counted_set = FlakeSet(params.leaf_level, params.table_level, params.seed);
    counts[index] = counted_flakes(footprints[index]);
  }
}
