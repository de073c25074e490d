// Atanasov and Koylazov 2016: "A Practical Stochastic Algorithm for Rendering Mirror-Like Flakes".
//
// The hierarchy is over texture space alone. At its end the flakes of the footprint stand one by one with their normals;
// what each reflects is compared with every light, and is looked up in the environment. Where the footprint holds too many
// of them, the traversal ends sooner and the flakes of a node are counted by a draw from their number's law.
#include "shared/binomial.glsl"
#include "shared/directions.glsl"
#include "shared/flake_tree.glsl"
#include "shared/lit_probability.glsl"
#include "shared/microfacet.glsl"
#include "shared/smooth_lobe.glsl"

layout(push_constant) uniform Params {
  uint material; // Index of the material.
  float alpha; // Roughness.
  float slope_deviation; // Standard deviation of a flake's slope along an axis: alpha / sqrt(2).
  float sin2_half_gamma; // sin^2 of half the cone's half-angle.
  float flakes; // In one square of texture space: N.
  uint flakes_low; // N as a whole number, its lower 32 bits,
  uint flakes_high; // and its upper ones.
  uint leaf_level; // Level of the tree on which flakes stand one by one.
  uint seed; // Of the flakes.
  float enumerated_below; // Up to so many flakes in the footprint each is tested, whatever steps that takes.
  float blend_from; // From so many flakes in the footprint on, the smooth lobe is mixed in,
  float blend_to; // and from here on there is nothing else.
  uint samples; // Directions drawn for flakes that are not tested one by one.
};

const float ENUMERATING_STEPS = 5000.0; // What testing flakes one by one may take on average.
const float COUNTING_STEPS = 600.0; // What a traversal that only counts may take on average.
const float LIGHTS_AT_FULL_DEPTH = 4.0; // With more lights a traversal that counts is shorter by as much.
const int STEPS_KEPT = 2000; // Of `steps_left`, to end the traversal with: what comes after counts as expected.
const uint FIRST_COUNT_DRAW = 0x40000000u; // A node's words from here on count its lit flakes, one for each light.

Footprint covered;
vec3 o; // Towards the viewer, about n = +Z.
mat3 scene_from_local;
vec3 f0;
bool enumerated;
vec3 directions[MAX_LIGHTS]; // Towards the lights, about n = +Z; zero where there is no light to reflect.
float probabilities[MAX_LIGHTS]; // That a flake is lit.
float lit[MAX_LIGHTS]; // Weights of the lit flakes, added up.
float counted = 0.0; // Flakes of the footprint that were not tested one by one,
float undrawn = 0.0; // and those among them that no draw was left for.
vec3 reflected = vec3(0.0); // What the flakes reflect of the environment, added up.

// What a flake with this normal and weight reflects of the environment, but for the division by a N: its cone is entered by
// one direction in each frame.
vec3 reflected_by(vec3 m, float weight, vec2 u) {
  float o_m = dot(o, m);
  vec3 i = direction_in_cone(2.0 * o_m * m - o, sin2_half_gamma, u);
  if (o_m <= 0.0 || i.z <= 0.0) {
    return vec3(0.0);
  }
  float i_h = half_vector_cosine(i, o);
  vec3 radiance = environment_radiance(environment_from_scene(scene_from_local * i), 0.0);
  float shadowing = i.z * beckmann_g1_over_cosine(i.z, alpha) * beckmann_g1_over_cosine(o.z, alpha);
  return radiance * schlick(f0, i_h) * (weight * i_h * shadowing);
}

// Each flake of a leaf that lies in the footprint, against all lights.
void test_flakes(FlakeNode node, uvec2 key) {
  uint count = uint(node.flakes);
  for (uint flake = 0u; flake < count && steps_left > 0; ++flake) {
    --steps_left;
    vec2 place = node.offset + (vec2(flake_place(key, flake)) + 0.5) * (node.side / 4294967296.0);
    vec2 at = vec2(dot(covered.along_x, place), dot(covered.along_y, place));
    if (node.whole || all(greaterThanEqual(at, vec2(0.0))) && all(lessThan(at, vec2(1.0)))) {
      vec3 normal = flake_normal(key, flake, slope_deviation);
      float weight = length(normal);
      vec3 m = normal / weight;
      for (uint light = 0u; light < light_count(); ++light) {
        --steps_left;
        bool hit = reflects_into_cone(m, o, directions[light], sin2_half_gamma) && dot(directions[light], m) > 0.0;
        lit[light] += hit ? weight : 0.0;
      }
      if (has_environment()) {
        uint word = hash(flake, key.x, hash(key.y, frame.sample_index));
        reflected += reflected_by(m, weight, vec2(unit_from(word), unit_from(mixed(word))));
      }
    }
  }
}

// How many flakes of a node are lit: a draw for each light from the law of their number, given the node's. A part of a
// node holds a flake with the probability of its share. Draws are loops: once their steps are spent, of further nodes as
// many flakes are lit as expected, so that many bright lights lose fluctuation and not light.
void count_flakes(FlakeNode node, uvec2 key) {
  float share = share_of(node, covered);
  float count = float(node.flakes);
  counted += share * count;
  if (steps_left <= STEPS_KEPT) {
    undrawn += share * count;
    return;
  }
  float steps = float(light_count());
  for (uint light = 0u; light < light_count(); ++light) {
    if (probabilities[light] > 0.0) {
      float probability = share * probabilities[light];
      steps += binomial_steps(count, probability);
      lit[light] += binomial(count, probability, draw(key, FIRST_COUNT_DRAW + light));
    }
  }
  steps_left -= int(ceil(steps));
}

void visit(FlakeNode node) {
  uvec2 key = node_key(node.level, node.cell.x, node.cell.y, seed);
  if (enumerated) {
    test_flakes(node, key);
  } else {
    count_flakes(node, key);
  }
}

// What a flake reflects of the environment on average over all normals, by a few of them.
vec3 reflected_on_average(uvec2 pixel) {
  uint word = hash(pixel.x, pixel.y, frame.sample_index);
  vec4 shift = vec4(unit_from(word), unit_from(mixed(word)), unit_from(mixed(~word)), unit_from(hash(word, 1u)));
  vec3 sum = vec3(0.0);
  for (uint index = 0u; index < samples; ++index) {
    vec2 u = fract(hammersley(index, samples) + shift.xy);
    vec3 m = sample_beckmann(u, alpha);
    // The cone's direction by the same points in another order.
    sum += reflected_by(m, 1.0 / m.z, fract(u.yx * vec2(7.0, 13.0) + shift.zw));
  }
  return sum / float(samples);
}

vec3 glint_radiance(GlintSurface surface) {
  scene_from_local = frame_about(surface.normal);
  o = surface.o * scene_from_local;
  f0 = surface.f0;
  covered = footprint_of(surface);
  float expected = covered.area * flakes;
  // Written so that a footprint that is no number, or none, is smooth, where its area does not matter.
  float smooth_share = !(expected >= 1e-18 * flakes)
    ? 1.0
    : clamp((expected - blend_from) / max(blend_to - blend_from, 1e-3), 0.0, 1.0);
  float steps = steps_to(covered, leaf_level) + expected * float(1u + light_count());
  uint end = leaf_level;
  if (!(expected <= enumerated_below && steps <= ENUMERATING_STEPS)) {
    float of_lights = min(LIGHTS_AT_FULL_DEPTH / float(max(light_count(), 1u)), 1.0);
    end = level_within(covered, leaf_level, COUNTING_STEPS * of_lights);
  }
  enumerated = end == leaf_level && steps <= ENUMERATING_STEPS;
  bool macro = !(steps_to(covered, 0u) <= COUNTING_STEPS);

  for (uint light = 0u; light < light_count(); ++light) {
    vec3 i = arrival_at(lights[light], surface.position).direction * scene_from_local;
    bool reaches = (surface.shadowed >> light & 1u) == 0u && i.z > 0.0;
    directions[light] = reaches ? i : vec3(0.0);
    probabilities[light] = 0.0;
    lit[light] = 0.0;
    if (reaches && !(enumerated && smooth_share == 0.0)) {
      probabilities[light] = min(lit_probability(i, o, sin2_half_gamma, alpha), 1.0);
    }
  }

  uint64_t root = uint64_t(flakes_high) << 32 | uint64_t(flakes_low);
  if (smooth_share < 1.0 && !macro) {
    visit_touched(covered, root, end, seed);
  } else {
    counted = expected;
  }

  // Over a N.
  float per_flake = smooth_share < 1.0 ? 1.0 / expected : 0.0;
  vec3 radiance = vec3(0.0);
  for (uint light = 0u; light < light_count(); ++light) {
    vec3 i = directions[light];
    if (i.z > 0.0) {
      float i_h = half_vector_cosine(i, o);
      // Flakes that are only counted have, to the first order in gamma, the weight 1 / (h.n).
      float weight = 2.0 * i_h / (i.z + o.z);
      float share = (enumerated ? lit[light] : (lit[light] + undrawn * probabilities[light]) * weight) * per_flake;
      if (macro && smooth_share < 1.0) {
        // Every square holds the same flakes.
        uint word = draw(node_key(0u, 0u, 0u, seed), FIRST_COUNT_DRAW + light);
        share = binomial(flakes, probabilities[light], word) / flakes * weight;
      }
      share = mix(share, probabilities[light] * weight, smooth_share);
      float shadowing = i.z * beckmann_g1_over_cosine(i.z, alpha) * beckmann_g1_over_cosine(o.z, alpha);
      vec3 irradiance = arrival_at(lights[light], surface.position).irradiance;
      radiance += irradiance * schlick(f0, i_h) * (i_h * shadowing * share / (4.0 * PI * sin2_half_gamma));
    }
  }
  if (has_environment()) {
    vec3 average = reflected_on_average(surface.pixel);
    vec3 sum = (reflected + counted * average) * per_flake;
    radiance += frame.environment.z * mix(sum, average, smooth_share);
  }
  return radiance;
}
