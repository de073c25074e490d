// Extracts P at the material's roughness and widens it from 1 degree to gamma by adding neighbouring entries.
//
// Wang, Deng and Holzschuch 2020, section 4.1: linear in alpha between two tables; section 4.2: the sum over whole-degree
// offsets of theta_i and delta_phi. Entries beyond the table are left out, as in the authors' earlier program (Wang et
// al. 2018): energy is lost within gamma / 2 of the pole and the horizon.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/dpf.glsl"

layout(local_size_x = 60) in;
layout(std430, binding = 30) readonly buffer Dpf { float dpf[]; };
layout(std430, binding = 40) writeonly buffer Accumulated { float accumulated[]; };
layout(push_constant) uniform Params {
  uint low; // Where the table of the roughness below begins.
  uint high; // Where the table of the roughness above begins.
  float part; // Weight of the latter.
  int first_offset; // Offsets in degrees: from here,
  int last_offset; // up to here.
  float scale; // Of the sum: the cone's solid angle over that of the entries; 1 where gamma is a whole number of degrees.
};

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= DPF_ENTRIES) {
    return;
  }
  int phi = int(index % DPF_PHI);
  int theta_i = int(index / DPF_PHI % DPF_THETA);
  uint theta_o = index / (DPF_PHI * DPF_THETA);
  float sum = 0.0;
  for (int row = theta_i + first_offset; row <= theta_i + last_offset; ++row) {
    if (row < 0 || row >= int(DPF_THETA)) {
      continue;
    }
    for (int column = phi + first_offset; column <= phi + last_offset; ++column) {
      // The function is even in delta_phi and has no entry at 180 degrees.
      int folded = abs(column);
      folded = folded > 180 ? 360 - folded : folded;
      uint at = dpf_index(theta_o, uint(row), uint(min(folded, int(DPF_PHI) - 1)));
      sum += mix(dpf[low + at], dpf[high + at], part);
    }
  }
  accumulated[index] = scale * sum;
}
