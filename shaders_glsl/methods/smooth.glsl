// The limit of infinitely many flakes: a smooth Beckmann lobe (Beckmann and Spizzichino 1963; Walter et al. 2007).
#include "shared/microfacet.glsl"
#include "shared/smooth_lobe.glsl"

layout(binding = 50) uniform texture2DArray prefiltered; // The environment by Beckmann's lobe.
layout(binding = 51) uniform texture2D albedo; // Directional albedo of Beckmann's lobe.
layout(push_constant) uniform Params {
  uint material; // Index of the material.
  float alpha; // Roughness.
};

vec3 glint_radiance(GlintSurface surface) {
  vec3 n = surface.normal;
  vec3 o = surface.o;
  float o_n = dot(o, n);
  vec3 radiance = vec3(0.0);
  if (frame.has_environment == 1u) {
    vec2 factors = lobe_albedo(albedo, clamp(o_n, 0.0, 1.0), alpha);
    vec3 mirrored = environment_from_scene(reflect(-o, n));
    radiance += frame.environment.z * prefiltered_radiance(prefiltered, mirrored, alpha) * (surface.f0 * factors.x + factors.y);
  }
  for (uint index = 0u; index < frame.light_count; ++index) {
    if ((surface.shadowed >> index & 1u) == 0u) {
      Arrival arrival = arrival_at(lights[index], surface.position);
      vec3 i = arrival.direction;
      vec3 sum = i + o;
      float length2 = dot(sum, sum);
      float i_n = dot(i, n);
      if (i_n > 0.0 && length2 > 1e-12) {
        vec3 h = sum * inversesqrt(length2);
        float shadowing = beckmann_g1_over_cosine(i_n, alpha) * beckmann_g1_over_cosine(o_n, alpha);
        float lobe = 0.25 * beckmann_d(h, n, alpha) * shadowing;
        radiance += arrival.irradiance * i_n * lobe * schlick(surface.f0, half_vector_cosine(i, o));
      }
    }
  }
  return radiance;
}
