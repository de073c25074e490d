// The limit of infinitely many flakes: a smooth Beckmann lobe (Beckmann and Spizzichino 1963; Walter et al. 2007).
#include "shared/lobe_light.glsl"

layout(push_constant) uniform Params {
  uint material; // Index of the material.
  float alpha; // Roughness.
};

float glint_density(GlintSurface surface, vec3 i, vec3 h) {
  return beckmann_d(h, surface.normal, alpha);
}

vec3 glint_radiance(GlintSurface surface) {
  return smooth_environment(surface, alpha) + lobe_under_lights(surface, alpha);
}
