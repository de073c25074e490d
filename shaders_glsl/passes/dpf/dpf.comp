// The directional probability function P(i, o, 1 degree) at one roughness, by quadrature of what the paper counts.
//
// Wang, Deng and Holzschuch 2020, section 4.1: 90 x 90 x 180 entries over (theta_o, theta_i, delta_phi).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/dpf.glsl"
#include "shared/lit_probability.glsl"

layout(local_size_x = 60) in;
layout(std430, binding = 40) writeonly buffer Dpf { float dpf[]; };
layout(push_constant) uniform Params {
  float alpha; // Roughness of this table.
  float sin2_half_gamma; // sin^2 of half the cone's half-angle.
  uint first; // Where this table begins.
};

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= DPF_ENTRIES) {
    return;
  }
  float degree = PI / 180.0;
  float phi = float(index % DPF_PHI) * degree;
  float theta_i = float(index / DPF_PHI % DPF_THETA) * degree;
  float theta_o = float(index / (DPF_PHI * DPF_THETA)) * degree;
  vec3 i = local_direction(theta_i, phi);
  vec3 o = local_direction(theta_o, 0.0);
  dpf[first + index] = lit_probability(i, o, sin2_half_gamma, alpha);
}
