// Jakob, Hasan, Yan, Lawrence, Ramamoorthi, Marschner 2014: "Discrete Stochastic Microfacet Models".
//
// Lights by the paper's BRDF; the environment by directions drawn as the paper draws them. One loop asks the tree for all of
// them, so that it is compiled once.
#include "shared/cells.glsl"
#include "shared/glint_surface.glsl"
#include "shared/jakob_tree.glsl"
#include "shared/lit_probability.glsl"
#include "shared/microfacet.glsl"
#include "shared/smooth_lobe.glsl"

layout(push_constant) uniform Params {
  uint material; // Index of the material.
  float alpha; // Roughness.
  float sin_half_gamma; // Sine of half the cone's half-angle,
  float cos_half_gamma; // and its cosine.
  float solid_angle; // Of the cone, in steradians: sigma.
  uint flakes_low; // Lower 32 bits of the number of flakes in a square of texture space: N.
  uint flakes_high; // Upper bits.
  uint seed; // Of the flakes.
  uint last_level; // Of squares that the tree divides.
  float split_ratio; // Mean solid angle asked for over mean area asked for.
  float epsilon; // Of criterion (10).
  float weight; // Of a flake.
  float density_integral; // Of D over the hemisphere: S_D.
  uint product; // 1 multiplies the share of places by the share of normals, each from a tree of its own.
  uint samples; // Directions drawn for the environment.
  uint steps; // For all walks of a pixel.
};

// A direction from which the environment is asked: a normal of twice the roughness reflects o, and the flakes' cone blurs
// that. `density` is exact: the chance that the reflection is within the cone about i, over the cone.
vec3 environment_sample(uvec2 pixel, uint index, vec3 o, out float density) {
  uint name = hash(pixel.x, pixel.y, hash(frame.sample_index, index));
  vec4 random = vec4(unit_from(name), unit_from(mixed(name + 1u)), unit_from(mixed(name + 2u)), unit_from(mixed(name + 3u)));
  vec3 h = sample_beckmann(random.xy, 2.0 * alpha);
  vec3 mirrored = 2.0 * dot(o, h) * h - o;
  vec3 i = direction_in_cone(mirrored, sin_half_gamma * sin_half_gamma, random.zw);
  density = lit_probability(o, i, sin_half_gamma * sin_half_gamma, 2.0 * alpha) / solid_angle;
  return i;
}

vec3 glint_radiance(GlintSurface surface) {
  steps_left = int(steps);
  mat3 to_local = frame_about(surface.normal);
  vec3 o = surface.o * to_local;
  vec2 within = within_cell(surface.uv);
  vec2 corner = within - 0.5 * (surface.uv_dx + surface.uv_dy);
  uint64_t flakes = uint64_t(flakes_high) << 32 | uint64_t(flakes_low);
  JakobFootprint footprint = jakob_footprint(flakes, corner, surface.uv_dx, surface.uv_dy);
  JakobTree tree = JakobTree(flakes, seed, last_level, split_ratio, epsilon);
  float all = max(float(flakes), 1.0);

  uint directions = has_environment() ? samples : 0u;
  uint queries = product + directions + light_count();
  float share_of_places = 1.0;
  vec3 radiance = vec3(0.0);
  for (uint query = 0u; query < queries; ++query) {
    bool places = query < product;
    vec3 i = o;
    vec3 strength = vec3(places ? 1.0 : 0.0); // Irradiance of a facing surface, or radiance over its density.
    if (!places && query < product + directions) {
      float density;
      i = environment_sample(surface.pixel, query - product, o, density);
      if (density > 1e-12) {
        vec3 towards = environment_from_scene(to_local * i);
        strength = frame.environment.z * environment_radiance(towards, 0.0) / (density * float(samples));
      }
    } else if (!places) {
      uint light = query - product - directions;
      if ((surface.shadowed >> light & 1u) == 0u) {
        Arrival arrival = arrival_at(lights[light], surface.position);
        i = arrival.direction * to_local;
        strength = arrival.irradiance;
      }
    }
    float i_n = i.z;
    if (i_n <= 0.0 || o.z <= 0.0 || strength == vec3(0.0)) {
      continue;
    }
    uint mode = places ? JAKOB_PLACES : (product == 1u ? JAKOB_NORMALS : JAKOB_BOTH);
    JakobCone cone = JakobCone(i, o, sin_half_gamma, cos_half_gamma);
    JakobCount found = jakob_count(tree, footprint, cone, mode, steps_left / int(queries - query));
    float share = (float(found.counted) + found.expected) / all;
    for (bool once = found.spent && mode == JAKOB_BOTH; once; once = false) {
      // The walk told too little: what is expected of the footprint stands, of flakes with density D / S_D.
      vec3 h = half_vector(i, o);
      float probability = lit_probability(i, o, sin_half_gamma * sin_half_gamma, alpha);
      share = h.z > 0.0 ? footprint.area * probability / (h.z * density_integral) : 0.0;
    }
    if (places) {
      share_of_places = share;
    } else {
      // Eq. 3 of the paper, with D-hat of Eq. 4.
      float density = weight * share_of_places * share / (footprint.area * solid_angle);
      float shadowing = beckmann_g1_over_cosine(i_n, alpha) * beckmann_g1_over_cosine(o.z, alpha);
      float i_h = half_vector_cosine(i, o);
      radiance += strength * schlick(surface.f0, i_h) * (i_h * shadowing * i_n * density);
    }
  }
  return radiance;
}
