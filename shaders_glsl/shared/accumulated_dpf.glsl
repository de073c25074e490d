// P(i, o, gamma) out of the accumulated table of directional probabilities.
#ifndef ACCUMULATED_DPF_GLSL
#define ACCUMULATED_DPF_GLSL
#include "shared/dpf.glsl"

layout(std430, binding = 50) readonly buffer Accumulated { float accumulated[]; };

// P(i, o, gamma), trilinear; directions about n = +Z.
float accumulated_probability(vec3 i, vec3 o) {
  if (i.z <= 0.0 || o.z <= 0.0) {
    return 0.0;
  }
  float degrees_of = 180.0 / PI;
  float theta_o = min(polar_angle(o) * degrees_of, 89.0);
  float theta_i = min(polar_angle(i) * degrees_of, 89.0);
  float turn = abs(azimuth(i) - azimuth(o)) * degrees_of;
  float phi = min(turn > 180.0 ? 360.0 - turn : turn, 179.0);
  uvec3 low = uvec3(floor(vec3(theta_o, theta_i, max(phi, 0.0))));
  vec3 part = vec3(theta_o, theta_i, phi) - vec3(low);
  uvec3 high = min(low + 1u, uvec3(89u, 89u, 179u));
  float p00 = mix(accumulated[dpf_index(low.x, low.y, low.z)], accumulated[dpf_index(low.x, low.y, high.z)], part.z);
  float p01 = mix(accumulated[dpf_index(low.x, high.y, low.z)], accumulated[dpf_index(low.x, high.y, high.z)], part.z);
  float p10 = mix(accumulated[dpf_index(high.x, low.y, low.z)], accumulated[dpf_index(high.x, low.y, high.z)], part.z);
  float p11 = mix(accumulated[dpf_index(high.x, high.y, low.z)], accumulated[dpf_index(high.x, high.y, high.z)], part.z);
  return mix(mix(p00, p01, part.y), mix(p10, p11, part.y), part.x);
}

#endif
