// Where a direction lies on an equirectangular map.
#ifndef EQUIRECT_GLSL
#define EQUIRECT_GLSL
#include "shared/constants.glsl"

// The centre of a row looks along -Z, its right quarter along +X; row 0 looks up. Straight up and down lie at u = 1/2
// by rule, as atan(0, 0) is whatever a driver makes of it: 3/8 of a turn, even. Domain: directions of any length from 1e-12
// to 1e18. Error of u at most 2.5e-4, as Vulkan promises of atan, and 6e-7 on lavapipe.
vec2 equirect_from(vec3 direction) {
  bool vertical = abs(direction.x) + abs(direction.z) < 1e-12;
  float u = vertical ? 0.5 : 0.5 + atan(direction.x, -direction.z) / (2.0 * PI);
  float v = atan(length(direction.xz), direction.y) / PI;
  return vec2(u, v);
}

vec3 direction_at(vec2 uv) {
  float azimuth = (uv.x - 0.5) * 2.0 * PI;
  float polar = uv.y * PI;
  float radius = sin(polar);
  return vec3(radius * sin(azimuth), cos(polar), -radius * cos(azimuth));
}

#endif
