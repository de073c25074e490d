// Point, directional and spot lights.
#ifndef LIGHTS_GLSL
#define LIGHTS_GLSL
#include "shared/constants.glsl"
#include "shared/effects.glsl"

struct Light {
  vec3 position; // In scene space; unused by directional lights.
  uint kind; // LIGHT_*.
  vec3 color; // Radiant intensity in W/sr, or irradiance in W/m^2 of a directional light.
  float range; // Beyond it there is no light; 0 is without end.
  vec3 direction; // Where a directional or spot light shines to.
  float cos_inner; // Cosine of the angle up to which a spot is full.
  float cos_outer; // Cosine of the angle from which it is dark.
  uint reserved[3];
};

layout(std430, binding = 9) readonly buffer Lights { Light lights[]; };

// What arrives at a point.
struct Arrival {
  vec3 direction; // Unit, towards the light.
  vec3 irradiance; // On a surface that faces the light.
  float distance; // To the light.
};

Arrival arrival_at(Light light, vec3 position) {
  if (DIRECTIONAL_LIGHTS && light.kind == LIGHT_DIRECTIONAL) {
    return Arrival(-light.direction, light.color, 1e30);
  }
  vec3 to_light = light.position - position;
  float squared = max(dot(to_light, to_light), 1e-12);
  float distance = sqrt(squared);
  vec3 direction = to_light / distance;
  float fall_off = 1.0;
  if (light.range > 0.0) {
    // The window of KHR_lights_punctual.
    float relative = squared / (light.range * light.range);
    fall_off = clamp(1.0 - relative * relative, 0.0, 1.0);
  }
  if (SPOT_LIGHTS && light.kind == LIGHT_SPOT) {
    float cosine = dot(-direction, light.direction);
    float inside = clamp((cosine - light.cos_outer) / max(light.cos_inner - light.cos_outer, 1e-3), 0.0, 1.0);
    fall_off *= inside * inside;
  }
  return Arrival(direction, light.color * (fall_off / squared), distance);
}

#endif
