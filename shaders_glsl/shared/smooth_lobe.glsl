// A smooth specular lobe under the environment, by two prefiltered tables (split sum, Karis 2013).
#ifndef SMOOTH_LOBE_GLSL
#define SMOOTH_LOBE_GLSL
#include "shared/environment.glsl"
#include "shared/frame.glsl"

layout(binding = 18) uniform sampler linear;

// Into the frame of the environment map, which is rotated about +Y.
vec3 environment_from_scene(vec3 direction) {
  vec2 turn = frame.environment.xy;
  return vec3(turn.x * direction.x - turn.y * direction.z, direction.y, turn.y * direction.x + turn.x * direction.z);
}

// Out of it.
vec3 scene_from_environment(vec3 stored) {
  vec2 turn = frame.environment.xy;
  return vec3(turn.x * stored.x + turn.y * stored.z, stored.y, -turn.y * stored.x + turn.x * stored.z);
}

// Radiance about the mirror direction as a lobe of this roughness sees it. Layers are mixed evenly in their spacing: in alpha^2, as
// `blurred_moment` has it, less light leaks into the dark, but means are farther off (engine/design/0011-cost-of-exactness.md).
vec3 prefiltered_radiance(texture2DArray prefiltered, vec3 direction, float alpha) {
  float layer = sqrt(clamp(alpha, 0.0, 1.0)) * float(SPECULAR_LAYERS - 1u);
  float below = min(floor(layer), float(SPECULAR_LAYERS - 2u));
  vec2 uv = equirect_from(direction);
  vec3 low = textureLod(sampler2DArray(prefiltered, linear_wrap_u), vec3(uv, below), 0.0).rgb;
  vec3 high = textureLod(sampler2DArray(prefiltered, linear_wrap_u), vec3(uv, below + 1.0), 0.0).rgb;
  return mix(low, high, layer - below);
}

// Factors of F0 and of 1 in the lobe's directional albedo.
vec2 lobe_albedo(texture2D albedo, float o_n, float alpha) {
  return textureLod(sampler2D(albedo, linear), vec2(o_n, alpha), 0.0).rg;
}

#endif
