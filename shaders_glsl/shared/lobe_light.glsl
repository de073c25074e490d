// A lobe under all light: the environment by the smooth lobe's split sum, and each point, directional or spot light by
// Cook and Torrance (1982) with the distribution of normals that the method gives.
#ifndef LOBE_LIGHT_GLSL
#define LOBE_LIGHT_GLSL
#include "shared/glint_surface.glsl"
#include "shared/microfacet.glsl"
#include "shared/smooth_lobe.glsl"

layout(binding = 50) uniform texture2DArray prefiltered; // The environment by Beckmann's lobe.
layout(binding = 51) uniform texture2D albedo; // Directional albedo of Beckmann's lobe.

// What the method counts: the density of normals at h as the footprint shows it, in 1/sr, normalised like D (the integral
// of D(h) (h.n) is 1). Directions are unit vectors in scene space, i.n and o.n positive.
float glint_density(GlintSurface surface, vec3 i, vec3 h);

// Radiance that a smooth Beckmann lobe of this roughness reflects of the environment.
vec3 smooth_environment(GlintSurface surface, float alpha) {
  if (!has_environment()) {
    return vec3(0.0);
  }
  vec3 n = surface.normal;
  vec2 factors = lobe_albedo(albedo, clamp(dot(surface.o, n), 0.0, 1.0), alpha);
  vec3 mirrored = environment_from_scene(reflect(-surface.o, n));
  return frame.environment.z * prefiltered_radiance(prefiltered, mirrored, alpha) * (surface.f0 * factors.x + factors.y);
}

// Radiance that the lights send by way of `glint_density`, shadowing by Smith for Beckmann normals of this roughness.
vec3 lobe_under_lights(GlintSurface surface, float alpha) {
  vec3 n = surface.normal;
  vec3 o = surface.o;
  vec3 radiance = vec3(0.0);
  for (uint index = 0u; index < light_count(); ++index) {
    if ((surface.shadowed >> index & 1u) == 0u) {
      Arrival arrival = arrival_at(lights[index], surface.position);
      vec3 i = arrival.direction;
      vec3 h = half_vector(i, o);
      float i_n = dot(i, n);
      if (i_n > 0.0 && h != vec3(0.0)) {
        float shadowing = beckmann_g1_over_cosine(i_n, alpha) * beckmann_g1_over_cosine(dot(o, n), alpha);
        float lobe = 0.25 * glint_density(surface, i, h) * shadowing;
        radiance += arrival.irradiance * i_n * lobe * schlick(surface.f0, half_vector_cosine(i, o));
      }
    }
  }
  return radiance;
}

#endif
