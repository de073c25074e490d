// Wang, Wang, Holzschuch 2018: "Fast Global Illumination with Discrete Stochastic Microfacets Using a Filterable Model".
//
// Where the flakes are and how they are turned are asked one after the other: a quadtree over texture space counts them,
// and each is lit with the probability P(i, o, gamma) of a table. Kept as they stand in the authors' program: the random
// numbers that decide it are drawn anew for each pair of directions in whole degrees; flakes have no weight 1 / (h.n); a
// leaf that lies partly inside counts by its share.
#include "shared/accumulated_dpf.glsl"
#include "shared/binomial.glsl"
#include "shared/directions.glsl"
#include "shared/flake_tree.glsl"
#include "shared/lit_probability.glsl"
#include "shared/microfacet.glsl"
#include "shared/smooth_lobe.glsl"

layout(push_constant) uniform Params {
  uint material; // Index of the material.
  float alpha; // Roughness.
  float sin2_half_gamma; // sin^2 of half the cone's half-angle.
  float flakes; // In one square of texture space: N.
  uint flakes_low; // N as a whole number, its lower 32 bits,
  uint flakes_high; // and its upper ones.
  uint leaf_level; // Level of the tree on which the traversal ends.
  uint seed; // Of the flakes.
  float expectation_above; // More lit flakes than this in a leaf are not drawn, but expected.
  uint samples; // Directions drawn from the environment.
  uint closed_form; // 1: P by quadrature, and not by the table.
  uint interpolated; // 1: linear between the table's entries with azimuths folded, and not the nearest.
  uint weighted; // 1: flakes have the weight 1 / (h.n).
};

const uint MAX_SAMPLES = 16u; // Of the environment, in a pixel and frame.
const uint MAX_SOURCES = MAX_LIGHTS + MAX_SAMPLES; // Lights, and directions drawn from the environment.
const float TRAVERSAL_STEPS = 1500.0; // What visiting leaves, each for all sources, may take on average.
const float LEAST_STEPS = 100.0; // A traversal is not cut shorter than this, however many sources there are.
const float MOST_PARTICLES = 16.0; // Up to so many flakes of a leaf are accepted one by one.
const uint FIRST_ACCEPTANCE_DRAW = 0x40000000u; // A node's words from here on accept its flakes.

Footprint covered;
uint sources; // Lights first.
float probabilities[MAX_SOURCES]; // That a flake is lit.
uint bins[MAX_SOURCES]; // The directions in whole degrees, hashed.
float lit[MAX_SOURCES]; // Flakes that are lit.
int draws_left = 4000; // Loop iterations left for acceptance,
float undrawn = 0.0; // and the flakes of the leaves that came after: those of them that are lit are expected.

// The table as the authors' program reads it: the nearest entry, without a look at where a row of 360 columns ends: half a
// degree before a full turn it is the first entry of the next row.
float nearest_probability(vec3 i, vec3 o) {
  float degrees_of = 180.0 / PI;
  float turn = (azimuth(i) - azimuth(o)) * degrees_of;
  turn = turn < 0.0 ? turn + 360.0 : turn;
  uint theta_o = uint(polar_angle(o) * degrees_of + 0.5);
  uint theta_i = uint(polar_angle(i) * degrees_of + 0.5);
  uint column = uint(turn + 0.5);
  theta_i += column / 360u;
  column %= 360u;
  // The table holds half of the 360 columns: the other half is the same.
  column = min(column > 180u ? 360u - column : column, DPF_PHI - 1u);
  return accumulated[dpf_index(min(theta_o, DPF_THETA - 1u), min(theta_i, DPF_THETA - 1u), column)];
}

float probability_of(vec3 i, vec3 o) {
  if (closed_form == 1u) {
    return lit_probability(i, o, sin2_half_gamma, alpha);
  }
  return interpolated == 1u ? accumulated_probability(i, o) : nearest_probability(i, o);
}

// The degree in which each angle of the two directions lies.
uint bin_of(vec3 i, vec3 o) {
  vec4 angles = vec4(polar_angle(i), azimuth(i), polar_angle(o), azimuth(o)) * (180.0 / PI) + 360.0;
  uvec4 degrees_of = uvec4(angles);
  return hash(degrees_of.x, degrees_of.y, hash(degrees_of.z, degrees_of.w));
}

void visit(FlakeNode node) {
  uvec2 key = node_key(node.level, node.cell.x, node.cell.y, seed);
  float share = share_of(node, covered);
  float count = float(node.flakes);
  if (draws_left <= 0) {
    undrawn += share * count;
    return;
  }
  float steps = 0.0;
  for (uint source = 0u; source < sources && share > 0.0; ++source) {
    steps += 1.0;
    float probability = probabilities[source];
    float mean = share * count * probability;
    if (mean > expectation_above) {
      lit[source] += mean;
      continue;
    }
    uint word = draw(key, FIRST_ACCEPTANCE_DRAW + bins[source]);
    float accepted = 0.0;
    if (count > MOST_PARTICLES) {
      // The same law in one draw.
      steps += binomial_steps(count, probability);
      accepted = probability > 0.0 ? binomial(count, probability, word) : 0.0;
    } else {
      steps += count;
      for (uint particle = 0u; particle < uint(count); ++particle) {
        accepted += rare_unit_from(hash(particle, word)) < probability ? 1.0 : 0.0;
      }
    }
    lit[source] += share * accepted;
  }
  draws_left -= int(ceil(steps));
}

vec3 glint_radiance(GlintSurface surface) {
  mat3 scene_from_local = frame_about(surface.normal);
  vec3 o = surface.o * scene_from_local;
  covered = footprint_of(surface);
  float expected = covered.area * flakes;

  // What a source adds if every flake is lit.
  vec3 each[MAX_SOURCES];
  uint drawn = has_environment() ? min(samples, MAX_SAMPLES) : 0u;
  sources = light_count() + drawn;
  uint word = hash(surface.pixel.x, surface.pixel.y, frame.sample_index);
  vec4 shift = vec4(unit_from(word), unit_from(mixed(word)), unit_from(mixed(~word)), unit_from(hash(word, 1u)));
  float solid_angle = 4.0 * PI * sin2_half_gamma;
  for (uint source = 0u; source < sources; ++source) {
    bool is_light = source < light_count();
    vec3 i;
    vec3 radiance;
    if (is_light) {
      Arrival arrival = arrival_at(lights[source], surface.position);
      i = arrival.direction * scene_from_local;
      radiance = (surface.shadowed >> source & 1u) == 0u ? arrival.irradiance / solid_angle : vec3(0.0);
    } else {
      // Where a random flake reflects to: by density P / sigma, so that the table's error cancels.
      vec2 u = hammersley(source - light_count(), drawn);
      vec3 m = sample_beckmann(fract(u + shift.xy), alpha);
      float o_m = dot(o, m);
      i = direction_in_cone(2.0 * o_m * m - o, sin2_half_gamma, fract(u.yx * vec2(7.0, 13.0) + shift.zw));
      vec3 seen = environment_radiance(environment_from_scene(scene_from_local * i), 0.0);
      radiance = o_m > 0.0 ? frame.environment.z / float(drawn) * seen : vec3(0.0);
    }
    bool reaches = i.z > 0.0 && o.z > 0.0 && radiance != vec3(0.0);
    float i_h = half_vector_cosine(i, o);
    float shadowing = i.z * beckmann_g1_over_cosine(i.z, alpha) * beckmann_g1_over_cosine(o.z, alpha);
    float weight = weighted == 1u ? 2.0 * i_h / max(i.z + o.z, 1e-6) : 1.0;
    float probability = reaches ? clamp(probability_of(i, o), 0.0, 1.0) : 0.0;
    vec3 all_lit = radiance * schlick(surface.f0, i_h) * (i_h * shadowing * weight);
    probabilities[source] = probability;
    each[source] = probability > 1e-9 ? (is_light ? all_lit : all_lit / probability) : vec3(0.0);
    bins[source] = bin_of(i, o);
    lit[source] = 0.0;
  }

  uint64_t root = uint64_t(flakes_high) << 32 | uint64_t(flakes_low);
  // Written so that a footprint that is no number, or none, shows what is expected, where its area does not matter.
  bool traversed = expected >= 1e-18 * flakes && steps_to(covered, 0u) <= TRAVERSAL_STEPS;
  if (traversed) {
    float steps = max(TRAVERSAL_STEPS / float(max(sources, 1u)), LEAST_STEPS);
    visit_touched(covered, root, level_within(covered, leaf_level, steps), seed);
  }
  vec3 radiance = vec3(0.0);
  for (uint source = 0u; source < sources; ++source) {
    float share = (lit[source] + undrawn * probabilities[source]) / expected;
    radiance += each[source] * (traversed ? share : probabilities[source]);
  }
  return radiance;
}
