// The mean of the environment over a flake's cone: a table of all but the small bright lights, whose edges no table of
// directions is fine enough for, and a ring about each of these (engine/render/src/scene/small_lights.rs).
#ifndef CONE_MEANS_GLSL
#define CONE_MEANS_GLSL
#include "shared/environment.glsl"

struct SmallLight {
  vec3 direction; // Towards it, unit, in the frame of the environment map.
  float inner_chord; // Up to this distance from it, as a chord of the unit sphere, a direction's cone holds it wholly.
  vec3 tangent; // Unit, across its direction: azimuth 0 of its ring.
  float per_chord; // 1 over the width of the ring, beyond which no cone holds any of it.
  vec3 irradiance; // On a surface that faces it.
  float reserved;
};

layout(binding = 51) uniform texture2D environment_cone; // Means over the flakes' cone, without the small lights.
layout(binding = 52) uniform texture2DArray light_rings; // Of each light: by azimuth and by distance.
layout(std430, binding = 53) readonly buffer SmallLights { SmallLight small_lights[]; };

// Of the cone about a unit direction in the frame of the environment map, with the first `count` small lights.
vec3 environment_over_cone(vec3 towards, uint count) {
  vec3 radiance = textureLod(sampler2D(environment_cone, linear_wrap_u), equirect_from(towards), 0.0).rgb;
  for (uint index = 0u; index < count; ++index) {
    SmallLight light = small_lights[index];
    float along = (length(towards - light.direction) - light.inner_chord) * light.per_chord;
    // Loops that run once or never, as some drivers execute branches always.
    for (bool near = along < 1.0; near; near = false) {
      vec2 across = vec2(dot(towards, light.tangent), dot(towards, cross(light.direction, light.tangent)));
      float azimuth = dot(across, across) > 1e-20 ? atan(across.y, across.x) / (2.0 * PI) : 0.0;
      float row = (clamp(along, 0.0, 1.0) * float(RING_DISTANCES - 1u) + 0.5) / float(RING_DISTANCES);
      radiance += textureLod(sampler2DArray(light_rings, linear_wrap_u), vec3(azimuth, row, index), 0.0).rgb;
    }
  }
  return radiance;
}

#endif
