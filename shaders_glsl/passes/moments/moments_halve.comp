// One level of the moments from the finer one: each texel the mean over its four, by their solid angles.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/constants.glsl"
#include "shared/moment_levels.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 40) buffer MomentLevels { TexelMoments moments[]; };
layout(push_constant) uniform Params {
  uint level; // The one that is made.
};

void main() {
  uvec2 at = gl_GlobalInvocationID.xy;
  uvec2 size = level_size(level);
  if (any(greaterThanEqual(at, size))) {
    return;
  }
  uint finer = level_begin(level - 1u);
  uint row = 2u * size.x;
  // Both texels of a row have the solid angle cos(pi v0) - cos(pi v1) a radian of azimuth, in proportion to the sine of
  // the row's middle.
  float step = PI / float(2u * size.y);
  float upper = sin((float(2u * at.y) + 0.5) * step);
  float lower = sin((float(2u * at.y) + 1.5) * step);
  TexelMoments sum = TexelMoments(vec4(0.0), vec4(0.0));
  for (uint corner = 0u; corner < 4u; ++corner) {
    uvec2 from = 2u * at + uvec2(corner & 1u, corner >> 1);
    TexelMoments part = moments[finer + from.y * row + from.x];
    float weight = 0.5 * (corner < 2u ? upper : lower) / (upper + lower);
    sum.first += weight * part.first;
    sum.second += weight * part.second;
  }
  moments[level_begin(level) + at.y * size.x + at.x] = sum;
}
