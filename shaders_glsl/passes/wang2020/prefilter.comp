// The 4D table of Wang, Deng and Holzschuch 2020: L-hat (Eq. 16) and P-hat (Eq. 17) by normal and view.
//
// The reflectance F is left out of M and applied when shading, so that an edit of the colour rebuilds nothing.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/environment.glsl"
#include "shared/directions.glsl"
#include "shared/microfacet.glsl"
#include "shared/wang2020_tables.glsl"

layout(local_size_x = 36) in;
layout(std430, binding = 30) readonly buffer Probability { float probability[]; };
layout(std430, binding = 40) writeonly buffer Prefiltered { vec4 prefiltered[]; }; // rgb: L-hat; w: P-hat.
layout(push_constant) uniform Params {
  float alpha; // Roughness.
  uint samples; // K: directions drawn from the BRDF for each entry.
};

void main() {
  uint index = gl_GlobalInvocationID.y * PREFILTER_PHI_O + gl_GlobalInvocationID.x;
  uint about_normal = gl_GlobalInvocationID.y % PREFILTER_THETA_O * PREFILTER_PHI_O + gl_GlobalInvocationID.x;
  uint normal_index = gl_GlobalInvocationID.y / PREFILTER_THETA_O;
  if (normal_index >= PREFILTER_THETA_N * PREFILTER_PHI_N || gl_GlobalInvocationID.x >= PREFILTER_PHI_O) {
    return;
  }
  float theta_n = float(normal_index / PREFILTER_PHI_N) / float(PREFILTER_THETA_N - 1u) * PI;
  float phi_n = float(normal_index % PREFILTER_PHI_N) / float(PREFILTER_PHI_N) * 2.0 * PI;
  // The frame's azimuth is the grid's also at the poles, where the normal alone would not tell it.
  mat3 from_normal = mat3(
    vec3(cos(theta_n) * sin(phi_n), -sin(theta_n), -cos(theta_n) * cos(phi_n)),
    vec3(cos(phi_n), 0.0, sin(phi_n)),
    vec3(sin(theta_n) * sin(phi_n), cos(theta_n), -sin(theta_n) * cos(phi_n))
  );
  uint theta_index = about_normal / PREFILTER_PHI_O;
  float theta_o = min(float(theta_index) / float(PREFILTER_THETA_O - 1u) * 0.5 * PI, 0.4999 * PI);
  vec3 o = local_direction(theta_o, float(about_normal % PREFILTER_PHI_O) / float(PREFILTER_PHI_O) * 2.0 * PI);
  vec3 n = vec3(0.0, 0.0, 1.0);

  vec3 sum = vec3(0.0);
  for (uint j = 0u; j < samples; ++j) {
    vec3 h = sample_beckmann(hammersley(j, samples), alpha);
    float o_h = dot(o, h);
    vec3 i = 2.0 * o_h * h - o;
    if (o_h > 0.0 && i.z > 0.0) {
      float p = accumulated_probability(i, o);
      if (p > 0.0) {
        // M without F; the cosines below G1 are cancelled by hand.
        float m = o_h * beckmann_g1_over_cosine(i.z, alpha) * beckmann_g1_over_cosine(o.z, alpha);
        float pdf = beckmann_d(h, n, alpha) * h.z / (4.0 * o_h);
        sum += environment_radiance(from_normal * i, 0.0) * (p * m / max(pdf, 1e-20));
      }
    }
  }
  prefiltered[index] = vec4(sum / float(samples), probability[about_normal]);
}
