// Radiance from everywhere: an equirectangular map, and where a direction lies in it.
#ifndef ENVIRONMENT_GLSL
#define ENVIRONMENT_GLSL
#include "shared/equirect.glsl"

layout(binding = 10) uniform texture2D environment;
layout(binding = 11) uniform sampler linear_wrap_u;

vec3 environment_radiance(vec3 direction, float lod) {
  return textureLod(sampler2D(environment, linear_wrap_u), equirect_from(direction), lod).rgb;
}

#endif
