// Radiance from everywhere: an equirectangular map, and where a direction lies in it.
#ifndef ENVIRONMENT_GLSL
#define ENVIRONMENT_GLSL
#include "shared/constants.glsl"

layout(binding = 10) uniform texture2D environment;
layout(binding = 11) uniform sampler linear_wrap_u;

// The centre of a row looks along -Z, its right quarter along +X; row 0 looks up. Straight up and down lie at u = 1/2
// by rule, as atan(0, 0) is whatever a driver makes of it.
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

vec3 environment_radiance(vec3 direction, float lod) {
  return textureLod(sampler2D(environment, linear_wrap_u), equirect_from(direction), lod).rgb;
}

#endif
