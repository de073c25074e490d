// Jakob et al. 2014: "Discrete Stochastic Microfacet Models", flake by flake.
//
// Every flake in the pixel's footprint is looked at, and each light tested against it; the environment is what each
// flake mirrors, averaged over its cone. A pixel that is not finished goes on in the next pass from where it stopped.
#include "shared/cone_means.glsl"
#include "shared/flakes_in_footprint.glsl"
#include "shared/footprint_area.glsl"
#include "shared/lit_probability.glsl"
#include "shared/microfacet.glsl"
#include "shared/smooth_lobe.glsl"

struct Walker {
  float radiance[3]; // So far.
  int next_column; // Where the walk goes on,
  int next_row;
  uint state; // WALK_*.
};

const uint WALK_AHEAD = 0u; // As a buffer of zeros says.
const uint WALK_LEFT = 1u; // It goes on in the next pass.
const uint WALK_OVER = 2u;
const uint EXPECTED_NORMALS = 512u; // Normals that stand for infinitely many flakes under the environment.

layout(std430, binding = 50) buffer Walkers { Walker walkers[]; }; // One a pixel.
layout(push_constant) uniform Params {
  uint material; // Index of the material.
  float alpha; // Roughness.
  float flakes; // In one square of texture space: N.
  float slope_deviation; // alpha / sqrt(2).
  uint sin2_half_gamma_low; // sin^2(gamma/2) as f64: its low word,
  uint sin2_half_gamma_high; // and its high word.
  uint seed; // Of the flakes.
  uint leaf_level; // Of the quadtree.
  uint table_level; // Of the table of counts.
  float most_steps; // A footprint that may take more shows what is expected of it.
  uint steps; // Taken in this pass at most.
  uint last; // 1 in the last pass of a frame.
  uint small_light_count; // Small bright lights of the environment.
};

// What light of one direction adds if a flake of weight 1 is lit, times the flakes' number and the cone's solid angle:
// (i.h) F G / ((i.n) (o.n)) irradiance (i.n), over the footprint's area.
vec3 reflected(GlintSurface surface, Arrival arrival, float area) {
  vec3 n = surface.normal;
  float i_n = dot(arrival.direction, n);
  float shadowing = beckmann_g1_over_cosine(i_n, alpha) * beckmann_g1_over_cosine(dot(surface.o, n), alpha);
  float i_h = half_vector_cosine(arrival.direction, surface.o);
  return arrival.irradiance * schlick(surface.f0, i_h) * (max(i_n, 0.0) * i_h * shadowing / area);
}

// What a flake of this normal mirrors of the environment, with so many of its small lights, over its weight, the flakes' number
// and the footprint's area.
vec3 mirrored_environment(GlintSurface surface, vec3 m, mat3 from_local, uint small) {
  vec3 o = surface.o;
  vec3 facet = from_local * m;
  float o_m = dot(o, facet);
  vec3 r = 2.0 * o_m * facet - o;
  float r_n = dot(r, surface.normal);
  if (o_m <= 0.0 || r_n <= 0.0) {
    return vec3(0.0);
  }
  vec3 light = environment_over_cone(environment_from_scene(r), small);
  float shadowing = beckmann_g1_over_cosine(r_n, alpha) * r_n * beckmann_g1_over_cosine(dot(o, surface.normal), alpha);
  return frame.environment.z * light * schlick(surface.f0, o_m) * (o_m * shadowing);
}

// What infinitely many flakes of these cones show.
vec3 expected_radiance(GlintSurface surface, mat3 to_local, double sin2_half_gamma) {
  float solid_angle = 4.0 * PI * float(sin2_half_gamma);
  vec3 n = surface.normal;
  vec3 radiance = vec3(0.0);
  for (uint index = 0u; index < (has_environment() ? EXPECTED_NORMALS : 0u); ++index) {
    vec3 m = sample_beckmann(hammersley(index, EXPECTED_NORMALS), alpha);
    radiance += mirrored_environment(surface, m, to_local, 0u) / (m.z * float(EXPECTED_NORMALS));
  }
  // The scene's lights and then the environment's small ones, which few normals would find or miss by chance.
  for (uint index = 0u; index < light_count() + small_light_count; ++index) {
    bool of_environment = index >= light_count();
    if (of_environment || (surface.shadowed >> index & 1u) == 0u) {
      Arrival arrival;
      if (of_environment) {
        SmallLight light = small_lights[index - light_count()];
        arrival = Arrival(scene_from_environment(light.direction), frame.environment.z * light.irradiance, 1e30);
      } else {
        arrival = arrival_at(lights[index], surface.position);
      }
      vec3 i = arrival.direction;
      vec3 sum = i + surface.o;
      float h_n = dot(sum, n) * inversesqrt(max(dot(sum, sum), 1e-12));
      if (dot(i, n) > 0.0 && h_n > 0.0) {
        // Flakes weigh 1 / (m.n).
        float lit = lit_probability(i * to_local, surface.o * to_local, float(sin2_half_gamma), alpha) / h_n;
        radiance += reflected(surface, arrival, 1.0) * (lit / solid_angle);
      }
    }
  }
  return radiance;
}

vec3 glint_radiance(GlintSurface surface) {
  uint at = surface.pixel.y * frame.width + surface.pixel.x;
  Walker walker = walkers[at];
  vec3 radiance = vec3(walker.radiance[0], walker.radiance[1], walker.radiance[2]);
  mat3 from_local = frame_about(surface.normal);
  vec3 o_local = surface.o * from_local;
  double sin2_half_gamma = packDouble2x32(uvec2(sin2_half_gamma_low, sin2_half_gamma_high));
  vec2 side_x = surface.uv_dx;
  vec2 side_y = surface.uv_dy;
  float area = footprint_area(side_x, side_y);
  FlakeSet set = FlakeSet(leaf_level, table_level, seed);
  bool lit_by_environment = has_environment();
  bool begins = walker.state == WALK_AHEAD;
  bool finished = walker.state == WALK_OVER;
  bool expects = false;

  // Loops that run once or never: drivers that run pixels as lanes of one thread execute what is in a branch for all of
  // them, but leave a loop when the last has.
  for (bool once = begins; once; once = false) {
    float tests = float(light_count()) + (lit_by_environment ? 1.0 : 0.0);
    float steps_expected = flake_walk_steps(set, side_x, side_y, flakes, tests);
    // Written so that a footprint that is no number shows what is expected, too.
    expects = !(steps_expected <= most_steps) || area < 1e-30;
    finished = expects;
  }
  for (bool once = !finished; once; once = false) {
    vec3 towards[MAX_LIGHTS];
    vec3 each[MAX_LIGHTS];
    uint reaching = 0u;
    float over_flakes = 1.0 / (flakes * 4.0 * PI * float(sin2_half_gamma));
    for (uint index = 0u; index < light_count(); ++index) {
      Arrival arrival = arrival_at(lights[index], surface.position);
      if ((surface.shadowed >> index & 1u) == 0u && dot(arrival.direction, surface.normal) > 0.0) {
        towards[reaching] = arrival.direction * from_local;
        each[reaching] = reflected(surface, arrival, area) * over_flakes;
        ++reaching;
      }
    }
    FlakeWalk walk = start_flake_walk(set, footprint_corner(surface.uv, side_x, side_y), side_x, side_y);
    if (!begins) {
      resume_flake_walk(walk, ivec2(walker.next_column, walker.next_row));
    }
    int steps_left = int(steps);
    while (steps_left > 0 && !flake_walk_is_over(walk)) {
      steps_left -= next_flake_leaf(set, walk);
      LeafCross leaf_x = leaf_cross(walk, walk.across_x, walk.corner_x);
      LeafCross leaf_y = leaf_cross(walk, walk.across_y, walk.corner_y);
      for (uint flake = 0u; flake < walk.flakes; ++flake) {
        --steps_left;
        bool inside = flake_is_inside(walk, leaf_x, leaf_y, flake);
        vec3 normal = flake_normal(walk.leaf, flake, slope_deviation);
        float weight = length(normal);
        for (uint index = inside ? 0u : reaching; index < reaching; ++index) {
          --steps_left;
          bool lit = flake_is_lit(normal, towards[index], o_local, sin2_half_gamma);
          radiance += lit ? weight * each[index] : vec3(0.0);
        }
        for (bool mirrors = inside && lit_by_environment; mirrors; mirrors = false) {
          --steps_left;
          radiance += weight / (area * flakes) * mirrored_environment(
            surface, normal / weight, from_local, small_light_count
          );
        }
      }
    }
    finished = flake_walk_is_over(walk);
    walker.next_column = walk.next.x;
    walker.next_row = walk.next.y;
  }
  // Beyond six standard deviations of what was allowed for, the last pass gives up.
  for (bool once = expects || (!finished && last != 0u); once; once = false) {
    radiance = expected_radiance(surface, from_local, sin2_half_gamma);
  }
  walker.radiance = float[](radiance.x, radiance.y, radiance.z);
  walker.state = finished ? WALK_OVER : WALK_LEFT;
  walkers[at] = walker;
  return radiance;
}
