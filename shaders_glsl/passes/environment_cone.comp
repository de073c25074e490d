// The environment averaged over a cone about each direction: what a flake that mirrors that direction shows.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/environment.glsl"
#include "shared/directions.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 40, rgba32f) uniform writeonly image2D cone;
layout(push_constant) uniform Params {
  uint samples; // Directions drawn for each texel, of equal solid angle.
  float sin2_half_gamma; // Of the cone's half-angle.
  float level; // Of the environment, whose texels are as large as a sample's part of the cone.
};

void main() {
  ivec2 size = imageSize(cone);
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, size))) {
    return;
  }
  vec3 axis = direction_at((vec2(at) + 0.5) / vec2(size));
  vec3 sum = vec3(0.0);
  for (uint index = 0u; index < samples; ++index) {
    sum += environment_radiance(direction_in_cone(axis, sin2_half_gamma, hammersley(index, samples)), level);
  }
  imageStore(cone, at, vec4(sum / float(samples), 1.0));
}
