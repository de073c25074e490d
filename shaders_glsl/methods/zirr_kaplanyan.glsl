// T. Zirr and A. S. Kaplanyan 2016: "Real-time Rendering of Procedural Multiscale Materials", isotropic roughness.
//
// Kept as they stand: sizes below 0 are folded back to tiny positive ones, and the count is divided by them; fewer than one
// flake in a cell can still give a whole one; the Gaussian branch lacks a factor sqrt 2; two grids are blended linearly,
// which takes variance away; the light's cone adds a floor to the lobe. The sine hash is an integer one here.
#include "shared/blended_count.glsl"
#include "shared/cells.glsl"
#include "shared/directions.glsl"
#include "shared/footprint_area.glsl"
#include "shared/hash.glsl"
#include "shared/lobe_light.glsl"
#include "shared/loop_budget.glsl"

layout(push_constant) uniform Params {
  uint material; // Index of the material.
  uint seed; // Of the flakes.
  float alpha; // Roughness of the whole lobe.
  float sin_half_gamma; // Of the half-angle of a flake's reflection cone.
  float density; // Flakes in a square of texture space.
  float cone; // Angular radius of the lights, radians.
  float variation; // Of the flakes' number from cell to cell.
  float dynamic_range; // Greatest density, in units of the smooth one.
  uint long_cells; // Cells walked along the footprint's long axis, at most.
  uint root_two; // 1 restores the factor that the Gaussian branch lacks.
};

const int SHORT_CELLS = 4; // Cells walked across the long axis.

// Steps left to this invocation.
int steps_left = STEPS_A_INVOCATION;

// The footprint as the grids are walked: of the pixel's own area, one side along the pixel's longer derivative, the other
// along an axis of texture space.
struct Strip {
  uint along; // Axis on which it is longest: 0 is u, 1 is v.
  float extent; // Along it.
  float width; // Along the other axis.
  float skew; // Change of its middle on the other axis for a unit along.
};
Strip strip;

Strip strip_of(vec2 dx, vec2 dy) {
  vec2 box = max(abs(dx), abs(dy));
  Strip found;
  found.along = box.y > box.x ? 1u : 0u;
  vec2 x = found.along == 1u ? dx.yx : dx;
  vec2 y = found.along == 1u ? dy.yx : dy;
  vec2 side = abs(x.x) >= abs(y.x) ? x : y;
  found.extent = abs(side.x);
  found.width = footprint_area(x, y) / found.extent;
  found.skew = side.y / side.x;
  return found;
}

// The part of a cell's index that it shares with its even children: the index without its factors of 2.
int odd_part(int index) {
  return index == 0 ? 0 : index >> findLSB(index);
}

float glint_density(GlintSurface surface, vec3 i, vec3 h) {
  float i_h = half_vector_cosine(i, surface.o);
  float h_n = max(dot(h, surface.normal), 1e-6);
  // A flake's own lobe fills the solid angle sigma / (4 i.h) of half vectors, and is no wider than the whole lobe.
  float micro = min(sin_half_gamma * inversesqrt(max(i_h, 1e-6)), alpha);
  float facing = PI * micro * micro;
  float lit_by_cone = min(cone * cone / max(4.0 * i_h * h_n, 1e-6), 1.0);
  float probability = min(mix(facing * beckmann_d(h, surface.normal, alpha), 1.0, lit_by_cone), 1.0);
  float smooth_density = probability / facing;
  // Also where a footprint is no number: nothing is told apart in it.
  bool countable = strip.width > 1e-25 && strip.extent < 1e9;
  if (probability < 1e-30 || !countable) {
    return density > 0.0 ? smooth_density : 0.0;
  }

  vec3 half_vector = h * frame_about(surface.normal);
  float cone_cell = micro + cone;
  vec2 lobe_place = 0.75 * half_vector.xy / (half_vector.z + 1.0) / cone_cell;

  vec2 uv = strip.along == 1u ? surface.uv.yx : surface.uv;
  float level = log2(max(strip.width, strip.extent / float(long_cells - 2u)));
  float fine_level = floor(level);
  vec2 cell_size = vec2(ldexp(1.0, int(fine_level)), ldexp(1.0, int(fine_level) + 1));
  vec2 grid_weight = vec2(1.0 - (level - fine_level), level - fine_level);
  // First and number of the cells on the long axis, of the fine and of the coarse grid: as many as may be, about the middle.
  vec2 middle = uv.x / cell_size;
  vec2 reach = 0.5 * strip.extent / cell_size;
  vec2 most = vec2(float(long_cells));
  vec2 first = max(floor(middle - reach), floor(middle - 0.5 * most + 0.5));
  ivec2 cells = SHORT_CELLS * ivec2(clamp(floor(middle + reach) - first + 1.0, vec2(1.0), most));

  float counted = 0.0;
  float expected = 0.0;
  for (int at = 0; at < cells.x + cells.y && steps_left > 0; ++at) {
    --steps_left;
    int grid = at < cells.x ? 0 : 1;
    int inside = grid == 0 ? at : at - cells.x;
    float cell = cell_size[grid];
    float along = first[grid] + float(inside / SHORT_CELLS);
    float from = max(along, middle[grid] - reach[grid]);
    float to = min(along + 1.0, middle[grid] + reach[grid]);
    float across_middle = uv.y / cell + strip.skew * (0.5 * (from + to) - middle[grid]);
    float across_reach = 0.5 * strip.width / cell;
    float across = floor(across_middle - across_reach) + float(inside % SHORT_CELLS);
    float overlap = min(across + 1.0, across_middle + across_reach) - max(across, across_middle - across_reach);
    float weight = grid_weight[grid] * max(to - from, 0.0) * max(overlap, 0.0);
    if (weight > 0.0) {
      ivec2 index = cell_of(vec2(along, across));
      index = strip.along == 1u ? index.yx : index;
      uint place = hash(uint(odd_part(index.x)), uint(odd_part(index.y)), seed);
      vec2 shift = vec2(unit_from(hash(place, 1u)), unit_from(hash(place, 2u)));
      ivec2 cone_index = cell_of(lobe_place + shift);
      uint key = hash(uint(cone_index.x), uint(cone_index.y), place);
      float flakes = density * cell * cell;
      // erfinv of a number uniform in (-1, 1) is a normal number over sqrt 2.
      float size = 1.0 + variation * 0.70710678 * normal_from(place);
      size = size > 0.0 ? size : fract(size) / (1.0 - size);
      float sampled = max(flakes * size, min(1.0, flakes));
      counted += weight * blended_count(sampled, probability, key, root_two == 1u, steps_left);
      expected += weight * flakes * size;
    }
  }
  // Cells that a float cannot tell apart, so far from the origin, cover nothing.
  bool resolved = expected > 1e-30;
  float ratio = resolved ? counted / expected : (density > 0.0 ? probability : 0.0);
  return min(ratio, dynamic_range * probability) / facing;
}

vec3 glint_radiance(GlintSurface surface) {
  strip = strip_of(surface.uv_dx, surface.uv_dy);
  return smooth_environment(surface, alpha) + lobe_under_lights(surface, alpha);
}
