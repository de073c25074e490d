// Mean and mean square of the radiance that flakes mirror, by the direction that the middle one mirrors and by roughness: one
// roughness a layer, spaced as those of environment_specular.comp.
//
// Flakes are drawn as they are distributed, by the density D(h) (h.n), seen along the normal. Unlike a prefiltered mirror
// (Karis 2013) nothing is weighted by a cosine: what a flake shows is mean and mean square over flakes.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/directions.glsl"
#include "shared/environment.glsl"
#include "shared/microfacet.glsl"
#include "shared/moment_levels.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 30) readonly buffer MomentLevels { TexelMoments moments[]; };
layout(binding = 40, rgba32f) uniform writeonly image2DArray first_moment;
layout(binding = 41, rgba32f) uniform writeonly image2DArray second_moment;
layout(push_constant) uniform Params {
  uint samples; // Normals for each texel.
};

// A level, linear between texels.
TexelMoments level_moments(vec2 uv, uint level) {
  uvec2 size = level_size(level);
  vec2 at = uv * vec2(size) - 0.5;
  vec2 low = floor(at);
  vec2 part = at - low;
  TexelMoments sum = TexelMoments(vec4(0.0), vec4(0.0));
  for (uint corner = 0u; corner < 4u; ++corner) {
    ivec2 texel = ivec2(low) + ivec2(corner & 1u, corner >> 1);
    vec2 weights = mix(1.0 - part, part, vec2(corner & 1u, corner >> 1));
    uint column = uint(texel.x + int(size.x)) % size.x;
    uint row = uint(clamp(texel.y, 0, int(size.y) - 1));
    TexelMoments found = moments[level_begin(level) + row * size.x + column];
    sum.first += weights.x * weights.y * found.first;
    sum.second += weights.x * weights.y * found.second;
  }
  return sum;
}

void main() {
  ivec3 size = imageSize(first_moment);
  ivec3 at = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(at, size))) {
    return;
  }
  vec3 axis = direction_at((vec2(at.xy) + 0.5) / vec2(size.xy));
  mat3 from_axis = frame_about(axis);
  float spacing = float(at.z) / float(size.z - 1);
  float alpha = max(spacing * spacing, 1e-3);
  float texel = 4.0 * PI / float(MOMENTS_WIDTH * MOMENTS_WIDTH / 2u);
  TexelMoments sum = TexelMoments(vec4(0.0), vec4(0.0));
  float total = 0.0;
  for (uint index = 0u; index < samples; ++index) {
    vec3 local = sample_beckmann(hammersley(index, samples), alpha);
    vec3 mirrored = 2.0 * local.z * local - vec3(0.0, 0.0, 1.0);
    if (mirrored.z > 0.0) {
      // Each normal stands for its share of the lobe, D / 4 a steradian of mirrored directions: read the level whose
      // texels are that large.
      float density = beckmann_d(local, vec3(0.0, 0.0, 1.0), alpha) / 4.0;
      float level = 0.5 * log2(1.0 / (float(samples) * max(density, 1e-9) * texel));
      level = clamp(level, 0.0, float(MOMENTS_LEVELS - 1u));
      uint below = min(uint(level), MOMENTS_LEVELS - 2u);
      vec2 uv = equirect_from(from_axis * mirrored);
      TexelMoments fine = level_moments(uv, below);
      TexelMoments coarse = level_moments(uv, below + 1u);
      float part = level - float(below);
      sum.first += mix(fine.first, coarse.first, part);
      sum.second += mix(fine.second, coarse.second, part);
      total += 1.0;
    }
  }
  imageStore(first_moment, at, sum.first / max(total, 1.0));
  imageStore(second_moment, at, sum.second / max(total, 1.0));
}
