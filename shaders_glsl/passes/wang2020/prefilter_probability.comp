// P-hat of Wang, Deng and Holzschuch 2020, Eq. 17: 2 pi / B times the sum of P over B = 36 x 9 directions, as printed, or
// what that tends to with many.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/selection_probability.glsl"
#include "shared/wang2020_tables.glsl"

layout(local_size_x = 36) in;
layout(std430, binding = 40) writeonly buffer Probability { float probability[]; }; // By (theta_o, phi_o).
layout(push_constant) uniform Params {
  float alpha; // Roughness.
  float sin2_half_gamma; // sin^2 of half the cone's half-angle.
  uint closed; // 1: in closed form.
};

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= PREFILTER_THETA_O * PREFILTER_PHI_O) {
    return;
  }
  float theta_o = min(float(index / PREFILTER_PHI_O) / float(PREFILTER_THETA_O - 1u) * 0.5 * PI, 0.4999 * PI);
  vec3 o = local_direction(theta_o, float(index % PREFILTER_PHI_O) / float(PREFILTER_PHI_O) * 2.0 * PI);
  float sum = 0.0;
  uint directions = closed == 1u ? 0u : 324u;
  for (uint j = 0u; j < directions; ++j) {
    // Uniform over the hemisphere: equal steps of the cosine.
    float cosine = (float(j / 36u) + 0.5) / 9.0;
    float phi = float(j % 36u) / 36.0 * 2.0 * PI;
    float sine = sqrt(1.0 - cosine * cosine);
    sum += accumulated_probability(vec3(sine * cos(phi), sine * sin(phi), cosine), o);
  }
  probability[index] = closed == 1u ? selection_probability(o.z, alpha, sin2_half_gamma) : 2.0 * PI / 324.0 * sum;
}
