// The environment as a rough mirror that is looked at from its normal shows it, one roughness a layer (the first sum of
// Karis 2013, "Real Shading in Unreal Engine 4").
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/environment.glsl"
#include "shared/directions.glsl"
#include "shared/microfacet.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 40, rgba32f) uniform writeonly image2DArray prefiltered;
layout(push_constant) uniform Params {
  uint samples; // Normals drawn for each texel.
  uint beckmann; // 1: Beckmann's distribution; 0: GGX.
  float texel_solid_angle; // Mean solid angle of a texel of the environment, in steradians.
  float max_level; // Coarsest level of the environment.
};

void main() {
  ivec3 size = imageSize(prefiltered);
  ivec3 at = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(at, size))) {
    return;
  }
  vec3 normal = direction_at((vec2(at.xy) + 0.5) / vec2(size.xy));
  mat3 from_normal = frame_about(normal);
  // Layers are spaced by the square root of alpha; the first is nearly a mirror.
  float spacing = float(at.z) / float(size.z - 1);
  float alpha = max(spacing * spacing, 1e-3);
  vec3 sum = vec3(0.0);
  float total = 0.0;
  for (uint index = 0u; index < samples; ++index) {
    vec2 u = hammersley(index, samples);
    vec3 local = beckmann == 1u ? sample_beckmann(u, alpha) : sample_ggx(u, alpha);
    vec3 h = from_normal * local;
    vec3 i = 2.0 * dot(normal, h) * h - normal;
    float cosine = dot(normal, i);
    if (cosine > 0.0) {
      // Each sample stands for its share of the lobe: read the level whose texels are that large.
      float d = beckmann == 1u ? beckmann_d(h, normal, alpha) : ggx_d(h, normal, alpha);
      float solid_angle = 4.0 / (float(samples) * max(d, 1e-6));
      float level = clamp(0.5 * log2(solid_angle / texel_solid_angle) + 1.0, 0.0, max_level);
      sum += cosine * environment_radiance(i, level);
      total += cosine;
    }
  }
  imageStore(prefiltered, at, vec4(sum / max(total, 1e-6), 1.0));
}
