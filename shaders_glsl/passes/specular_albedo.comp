// Directional albedo of a microfacet lobe under Schlick's reflectance: what F0 and what 1 is to be multiplied by.
//
// Columns are (o.n), rows alpha, both at texel centres; the second sum of Karis 2013, here for G = G1(i) G1(o).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/directions.glsl"
#include "shared/microfacet.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 40, rg32f) uniform writeonly image2D albedo;
layout(push_constant) uniform Params {
  uint samples; // Normals drawn for each texel.
  uint beckmann; // 1: Beckmann's distribution; 0: GGX.
};

void main() {
  ivec2 size = imageSize(albedo);
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, size))) {
    return;
  }
  vec2 center = (vec2(at) + 0.5) / vec2(size);
  vec3 o = vec3(sqrt(1.0 - center.x * center.x), 0.0, center.x);
  float alpha = center.y;
  vec2 sum = vec2(0.0);
  for (uint index = 0u; index < samples; ++index) {
    vec2 u = hammersley(index, samples);
    vec3 h = beckmann == 1u ? sample_beckmann(u, alpha) : sample_ggx(u, alpha);
    float o_h = dot(o, h);
    vec3 i = 2.0 * o_h * h - o;
    if (o_h > 0.0 && i.z > 0.0) {
      // f (i.n) / pdf, with pdf = D (h.n) / 4 (o.h): D has cancelled, and both cosines with their G1.
      float g_over_cosines = beckmann == 1u
        ? beckmann_g1_over_cosine(i.z, alpha) * beckmann_g1_over_cosine(o.z, alpha)
        : ggx_g1_over_cosine(i.z, alpha) * ggx_g1_over_cosine(o.z, alpha);
      float weight = g_over_cosines * i.z * o_h / h.z;
      float away = 1.0 - o_h;
      float away2 = away * away;
      float fresnel = away2 * away2 * away;
      sum += weight * vec2(1.0 - fresnel, fresnel);
    }
  }
  imageStore(albedo, at, vec4(sum / float(samples), 0.0, 0.0));
}
