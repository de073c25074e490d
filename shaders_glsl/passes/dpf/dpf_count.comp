// The directional probability function as the paper has it: random flakes, counted.
//
// One invocation takes one flake and one polar angle of o: the flake mirrors o into i, and every entry whose direction
// lies within 1 degree of i has been hit. Entries are exact integers, so the order of the additions does not matter.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/dpf.glsl"
#include "shared/hash.glsl"
#include "shared/microfacet.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 40) buffer Hits { uint hits[]; };
layout(push_constant) uniform Params {
  float alpha; // Roughness of this table.
  float cos_gamma; // Cosine of the cone's half-angle.
  float gamma_degrees; // The cone's half-angle.
  uint first; // Where this table begins.
  uint first_flake; // Index of the first flake of this dispatch.
  uint flakes; // Flakes of this dispatch.
  uint seed; // Of the flakes.
};

void main() {
  uint flake = gl_GlobalInvocationID.x / DPF_THETA;
  uint theta_o = gl_GlobalInvocationID.x % DPF_THETA;
  if (flake >= flakes) {
    return;
  }
  uint bits = hash(first_flake + flake, seed);
  vec3 m = sample_beckmann(vec2(unit_from(bits), unit_from(mixed(bits))), alpha);
  float degree = PI / 180.0;
  vec3 o = local_direction(float(theta_o) * degree, 0.0);
  float o_m = dot(o, m);
  vec3 i = 2.0 * o_m * m - o;
  if (o_m <= 0.0 || i.z <= 0.0) {
    return;
  }
  float theta = polar_angle(i);
  float phi = azimuth(i) / degree;
  int low = max(int(ceil(theta / degree - gamma_degrees)), 0);
  int high = min(int(floor(theta / degree + gamma_degrees)), int(DPF_THETA) - 1);
  for (int row = low; row <= high; ++row) {
    float row_theta = float(row) * degree;
    // Half the arc of this row inside the cone, by the cosine rule on the sphere.
    float sines = sin(theta) * sin(row_theta);
    float cosine = (cos_gamma - cos(theta) * cos(row_theta)) / max(sines, 1e-9);
    if (cosine < 1.0) {
      float half_arc = cosine <= -1.0 ? 180.0 : acos(cosine) / degree;
      int from = int(ceil(phi - half_arc));
      int to = min(int(floor(phi + half_arc)), from + 359);
      for (int column = from; column <= to; ++column) {
        int folded = column < 0 ? column + 360 : column % 360;
        if (folded < int(DPF_PHI)) {
          atomicAdd(hits[first + dpf_index(theta_o, uint(row), uint(folded))], 1u);
        }
      }
    }
  }
}
