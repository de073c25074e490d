// The grid of the directional probability function of Wang et al. 2018 and 2020: entries at whole degrees.
#ifndef DPF_GLSL
#define DPF_GLSL
#include "shared/constants.glsl"

const uint DPF_THETA = 90u; // Polar angles of each direction, 0 to 89 degrees.
const uint DPF_PHI = 180u; // Differences of azimuth, 0 to 179 degrees.
const uint DPF_ENTRIES = 1458000u; // Entries of one table.
const uint DPF_ROUGHNESSES = 8u; // Tables: alpha .02, .04, .1, .2, .4, .6, .8, 1.

uint dpf_index(uint theta_o, uint theta_i, uint phi) {
  return (theta_o * DPF_THETA + theta_i) * DPF_PHI + phi;
}

vec3 local_direction(float theta, float phi) {
  return vec3(sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta));
}

// Polar angle by atan: acos is wrong by up to 1.6e-4 on some drivers, and steep at the pole.
float polar_angle(vec3 local) {
  return atan(length(local.xy), local.z);
}

float azimuth(vec3 local) {
  return abs(local.x) + abs(local.y) < 1e-12 ? 0.0 : atan(local.y, local.x);
}

#endif
