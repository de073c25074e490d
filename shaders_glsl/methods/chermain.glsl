// Chermain, Sauvage, Dischler, Dachsbacher 2020: "Procedural Physically based BRDF for Real-Time Rendering of Glints".
//
// Texture space is cut into cells, level by level; a cell's slopes follow the product of two distributions out of a
// dictionary, turned by an angle of the cell's own; a pixel shows the mean over the cells in its footprint.
#include "shared/chermain_dictionary.glsl"
#include "shared/directions.glsl"
#include "shared/hash.glsl"
#include "shared/lobe_light.glsl"
#include "shared/loop_budget.glsl"

layout(push_constant) uniform Params {
  uint material; // Index of the material.
  float alpha; // Roughness.
  float log4_flakes; // Logarithm, base 4, of the flakes in one square of texture space.
  uint seed; // Of the cells.
  float relative_area; // Share of the cells that have flakes.
  float density_deviation; // Standard deviation of a cell's level of detail.
  float max_anisotropy; // A footprint is widened until it is at most so many times as long as wide.
  uint whole_footprint; // 1: all cells of a footprint count, not the first hundred of its bounding box.
  uint plane_seeds; // 1: a cell's seed depends on both its coordinates, not on a sum of them.
  uint smith; // 1: Smith's shadowing instead of that of V-shaped cavities.
};

const int FINEST = 15; // Cells of level 0 are 2^-15 of a square wide, each level's twice the one's before.
const int COARSEST = 31; // Beyond this level, of cells 2^16 squares wide, all is smooth.
const float PRINTED_CELLS = 100.0; // So many cells of a bounding box are visited as published.
const float EDGE_WEIGHT = 0.1353352832; // exp(-2), the weight at a footprint's edge.

// Steps left to this invocation.
int steps_left = STEPS_A_INVOCATION;

// Density of slopes in the limit of many flakes, per unit of slope plane.
float smooth_slopes(vec2 slope) {
  float alpha2 = alpha * alpha;
  return exp(-dot(slope, slope) / alpha2) / (PI * alpha2);
}

// Random word `index` of a cell.
uint cell_word(uint key, uint index) {
  return mixed(key + 0x9e3779b9u * index);
}

// Density of slopes in a cell that is expected to hold 4^log4_inside flakes.
float cell_slopes(uint key, float log4_inside, vec2 slope) {
  if (unit_from(cell_word(key, 0u)) > relative_area) {
    return 0.0;
  }
  // A standard normal number by Box and Muller, for the paper's inverse of the error function.
  float radius = sqrt(-2.0 * log(unit_from(cell_word(key, 1u))));
  float normal = radius * cos(2.0 * PI * unit_from(cell_word(key, 2u)));
  float detail = clamp(floor(log4_inside + density_deviation * normal + 0.5), 0.0, float(CHERMAIN_LEVELS));
  uint level = uint(detail);
  if (level >= CHERMAIN_LEVELS) {
    return smooth_slopes(slope);
  }
  float turn = 2.0 * PI * unit_from(cell_word(key, 3u));
  vec2 axis = vec2(cos(turn), sin(turn));
  float scale = CHERMAIN_ALPHA / alpha;
  vec2 turned = scale * vec2(dot(slope, axis), axis.x * slope.y - axis.y * slope.x);
  uint along_x = uint(float(CHERMAIN_MARGINALS) * unit_from(cell_word(key, 4u)));
  uint along_y = uint(float(CHERMAIN_MARGINALS) * unit_from(cell_word(key, 5u)));
  return marginal_density(level, along_x, turned.x) * marginal_density(level, along_y, turned.y) * scale * scale;
}

// Cells of a row that lie in an ellipse, first and last, as offsets from its centre cell.
vec2 row_span(float row, vec2 centre, vec3 conic, float edge) {
  float y = row - centre.y;
  float half_width = sqrt(edge * max(conic.x - y * y, 0.0)) / conic.x;
  float middle = centre.x - 0.5 * conic.y * y / conic.x;
  return vec2(ceil(middle - half_width), floor(middle + half_width));
}

// Mean density of slopes over the cells of one level in a footprint with these axes, by the elliptical weighted average
// of Heckbert 1989 as Pharr, Jakob and Humphreys write it (pbrt-v3, section 10.4.5).
float level_slopes(vec2 uv, vec2 major, vec2 minor, int level, vec2 slope) {
  float cells = ldexp(1.0, FINEST - level);
  // Levels with whole cells in a square are counted from the square's corner, which keeps them apart far from the
  // origin.
  vec2 tile = level <= FINEST ? floor(clamp(uv, -1e9, 1e9)) : vec2(0.0);
  vec2 at = (uv - tile) * cells - 0.5;
  vec2 corner = floor(clamp(at, -1e9, 1e9));
  vec2 centre = clamp(at - corner, 0.0, 1.0);
  uvec2 origin = (uvec2(ivec2(tile)) << uint(max(FINEST - level, 0))) + uvec2(ivec2(corner));

  vec2 x = major * cells;
  vec2 y = minor * cells;
  // conic.x s^2 + conic.y s t + conic.z t^2 = edge, each axis lengthened by a cell. The edge is conic.x conic.z -
  // conic.y^2 / 4, multiplied out so that nothing cancels.
  vec3 conic = vec3(x.y * x.y + y.y * y.y + 1.0, -2.0 * (x.x * x.y + y.x * y.y), x.x * x.x + y.x * y.x + 1.0);
  float across = x.x * y.y - x.y * y.x;
  float edge = 1.0 + dot(x, x) + dot(y, y) + across * across;
  vec2 reach = sqrt(conic.zx);
  vec2 first = ceil(centre - reach);
  vec2 last = floor(centre + reach);
  float box_width = last.x - first.x + 1.0;
  float most = whole_footprint == 1u ? 1e9 : PRINTED_CELLS;

  vec2 sum = vec2(0.0);
  vec2 cell = vec2(0.0, first.y);
  vec2 span = row_span(cell.y, centre, conic, edge);
  cell.x = span.x;
  while (cell.y <= last.y && steps_left > 0) {
    --steps_left;
    if ((cell.y - first.y) * box_width + cell.x - first.x >= most) {
      break;
    }
    vec2 from_centre = cell - centre;
    vec2 squared = from_centre * from_centre;
    float radius2 = (conic.x * squared.x + conic.y * from_centre.x * from_centre.y + conic.z * squared.y) / edge;
    if (cell.x <= span.y && radius2 < 1.0) {
      uvec2 place = (origin + uvec2(ivec2(cell))) << uint(level);
      uint key = plane_seeds == 1u ? hash(place.x, place.y, seed) : hash(place.x + 1549u * place.y, seed);
      float weight = exp(-2.0 * radius2) - EDGE_WEIGHT;
      float log4_inside = log4_flakes - float(FINEST - level);
      sum += weight * vec2(cell_slopes(key, log4_inside, slope), 1.0);
    }
    cell.x += 1.0;
    if (cell.x > span.y) {
      cell.y += 1.0;
      span = row_span(cell.y, centre, conic, edge);
      cell.x = span.x;
    }
  }
  // As published this divides 0 by 0 where the first hundred cells of the box miss the ellipse.
  return sum.y > 0.0 ? sum.x / sum.y : smooth_slopes(slope);
}

// Density of slopes over the footprint: two levels, mixed.
float footprint_slopes(GlintSurface surface, vec2 slope) {
  vec2 major = surface.uv_dx;
  vec2 minor = surface.uv_dy;
  if (dot(major, major) < dot(minor, minor)) {
    major = surface.uv_dy;
    minor = surface.uv_dx;
  }
  float longer = length(major);
  float shorter = length(minor);
  if (shorter * max_anisotropy < longer) {
    // A side of no length is widened across the other.
    vec2 direction = shorter > 1e-6 * longer ? minor / shorter : vec2(-major.y, major.x) / longer;
    shorter = longer / max_anisotropy;
    minor = shorter * direction;
  }
  float exact_level = max(float(FINEST) + log2(max(shorter, 1e-30)), 0.0);
  // Written so that what is no number is smooth too.
  if (!(exact_level < float(COARSEST)) || !(longer < 1e9)) {
    return smooth_slopes(slope);
  }
  float level = floor(exact_level);
  float coarser = exact_level - level;
  float density = 0.0;
  for (int step = 0; step < 2; ++step) {
    float weight = step == 0 ? 1.0 - coarser : coarser;
    density += weight * level_slopes(surface.uv, major, minor, int(level) + step, slope);
  }
  return density;
}

float glint_density(GlintSurface surface, vec3 i, vec3 h) {
  vec3 local = h * frame_about(surface.normal);
  if (local.z < 1e-4) {
    return 0.0;
  }
  float cos2 = local.z * local.z;
  return footprint_slopes(surface, local.xy / local.z) / (cos2 * cos2);
}

// G / ((i.n) (o.n)) of cavities shaped like a V (Cook and Torrance 1982), finite up to the horizon.
float cavity_over_cosines(float i_n, float o_n, float h_n, float o_h) {
  return min(1.0 / min(i_n, o_n), 2.0 * h_n / o_h) / max(i_n, o_n);
}

vec3 glint_radiance(GlintSurface surface) {
  vec3 n = surface.normal;
  vec3 o = surface.o;
  float o_n = dot(o, n);
  vec3 radiance = smooth_environment(surface, alpha);
  for (uint index = 0u; index < light_count(); ++index) {
    if ((surface.shadowed >> index & 1u) == 0u) {
      Arrival arrival = arrival_at(lights[index], surface.position);
      vec3 i = arrival.direction;
      float i_n = dot(i, n);
      float o_h = half_vector_cosine(i, o);
      if (i_n > 0.0 && o_n > 0.0 && o_h > 1e-6) {
        vec3 h = (i + o) / (2.0 * o_h);
        float shadowing = smith == 1u
          ? beckmann_g1_over_cosine(i_n, alpha) * beckmann_g1_over_cosine(o_n, alpha)
          : cavity_over_cosines(i_n, o_n, dot(h, n), o_h);
        float lobe = 0.25 * glint_density(surface, i, h) * shadowing;
        radiance += arrival.irradiance * i_n * lobe * schlick(surface.f0, o_h);
      }
    }
  }
  return radiance;
}
