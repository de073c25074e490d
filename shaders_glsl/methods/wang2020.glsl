// Wang, Deng, Holzschuch 2020: "Real-Time Glints Rendering with Prefiltered Discrete Stochastic Microfacets", as printed.
//
// Kept as they stand in the paper: no cosine of the incident light in Eqs. 16 and 21; P-hat of Eq. 17, which does not
// depend on the light; one lambda a flake, so that those with a small one never go out; scales switched at 4 and 64
// flakes in the footprint, whether lit or not; flakes without a place inside their leaf, so that magnified leaves are
// squares.
#include "shared/cells.glsl"
#include "shared/footprint.glsl"
#include "shared/footprint_area.glsl"
#include "shared/hash.glsl"
#include "shared/loop_budget.glsl"
#include "shared/microfacet.glsl"
#include "shared/smooth_lobe.glsl"
#include "shared/wang2020_tables.glsl"

layout(std430, binding = 51) readonly buffer Prefiltered { vec4 prefiltered[]; };
layout(std430, binding = 52) readonly buffer Nodes { vec4 nodes[]; };
layout(std430, binding = 53) readonly buffer Bounds { vec4 bounds[]; };
layout(push_constant) uniform Params {
  uint material; // Index of the material.
  float alpha; // Roughness.
  float solid_angle; // Of the cone, in steradians: sigma.
  float flakes; // In one square of texture space: N.
  uint depth; // Level of the quadtree's leaves.
  uint cut_depth; // Level at which the traversal starts.
  uint seed; // Of the flakes.
  float micro_below; // Fewer flakes than this in the footprint: each is tested.
  float macro_above; // More than this: none is looked for.
  uint cosine; // 1 multiplies light by the cosine that the paper leaves out.
};

const float ALL = 2.0; // A threshold that every flake is below.
const float MAX_CUT_CELLS = 48.0; // A footprint over more cells than this is cut at a coarser level.
const uint MAX_LEAF_FLAKES = 128u; // A leaf with more flakes than this contributes its expectation.

// Steps left to this invocation.
int steps_left = STEPS_A_INVOCATION;

// Bits of x and y in turn: the place of a node in its level.
uint interleaved(uvec2 cell) {
  uvec2 spread = cell & 0xffffu;
  spread = (spread | spread << 8) & 0x00ff00ffu;
  spread = (spread | spread << 4) & 0x0f0f0f0fu;
  spread = (spread | spread << 2) & 0x33333333u;
  spread = (spread | spread << 1) & 0x55555555u;
  return spread.x | spread.y << 1;
}

// How many flakes of the footprint have a lambda below the threshold; flakes of a leaf that lies partly inside count by
// its share. First the cut: the cells of one level that the footprint touches; then each is gathered depth first, without
// a stack, as a node's place in its level tells its parent and its next sibling.
float flakes_below(float threshold, vec2 corner, vec2 side_x, vec2 side_y, float expected) {
  vec2 opposite = corner + side_x + side_y;
  vec2 low = min(min(corner, opposite), min(corner + side_x, corner + side_y));
  vec2 high = max(max(corner, opposite), max(corner + side_x, corner + side_y));
  vec2 extent = high - low;
  uint start = cut_depth;
  while (start > 0u && (extent.x * float(1u << start) + 1.0) * (extent.y * float(1u << start) + 1.0) > MAX_CUT_CELLS) {
    --start;
  }
  if ((extent.x + 1.0) * (extent.y + 1.0) > MAX_CUT_CELLS) {
    // More than that many whole squares of texture: their number is what is expected.
    return expected * min(threshold, 1.0);
  }
  float cells = float(1u << start);
  ivec2 first = ivec2(floor(low * cells));
  uvec2 span = uvec2(ivec2(floor(high * cells)) - first) + 1u;
  uint cut = span.x * span.y;
  float found = 0.0;
  uint cell_index = 0u;
  bool in_cell = false;
  uint level = start;
  uint place = 0u;
  vec2 tile = vec2(0.0);
  while (cell_index < cut && steps_left > 0) {
    --steps_left;
    if (!in_cell) {
      ivec2 cell = first + ivec2(cell_index % span.x, cell_index / span.x);
      tile = floor(vec2(cell) / cells);
      level = start;
      place = interleaved(uvec2(cell - ivec2(tile * cells)));
      in_cell = true;
    }
    uint at = ((1u << (2u * level)) - 1u) / 3u + place;
    vec4 node = nodes[at];
    float share = 0.0;
    if (node.y > 0.0) {
      vec4 box = bounds[at] + tile.xyxy;
      if (all(lessThan(box.xy, high)) && all(greaterThan(box.zw, low))) {
        share = share_inside(box, corner, side_x, side_y);
      }
    }
    bool leaf = node.w == 0.0;
    bool whole = share > 0.9999 && threshold >= 1.0;
    if (share > 0.0 && !leaf && !whole) {
      ++level;
      place <<= 2;
      continue;
    }
    if (share > 0.0) {
      if (threshold >= 1.0) {
        found += share * node.y;
      } else if (node.y > float(MAX_LEAF_FLAKES)) {
        found += share * node.y * threshold;
      } else {
        uint count = uint(node.y);
        for (uint flake = 0u; flake < count; ++flake) {
          --steps_left;
          found += rare_unit_from(hash(flake, at, seed)) < threshold ? share : 0.0;
        }
      }
    }
    while (level > start && (place & 3u) == 3u) {
      place >>= 2;
      --level;
    }
    if (level == start) {
      in_cell = false;
      ++cell_index;
    } else {
      ++place;
    }
  }
  return found;
}

// L-hat and P-hat, linear in all four angles.
vec4 prefiltered_at(vec3 n, vec3 o) {
  mat3 from_normal = frame_of_normal(n);
  vec3 local = o * from_normal;
  float radius = length(n.xz);
  float theta_n = atan(radius, n.y) / PI * float(PREFILTER_THETA_N - 1u);
  float phi_n = (radius > 1e-6 ? atan(n.x, -n.z) : 0.0) / (2.0 * PI) * float(PREFILTER_PHI_N);
  float theta_o = polar_angle(local) / (0.5 * PI) * float(PREFILTER_THETA_O - 1u);
  float phi_o = azimuth(local) / (2.0 * PI) * float(PREFILTER_PHI_O);
  phi_n = phi_n < 0.0 ? phi_n + float(PREFILTER_PHI_N) : phi_n;
  phi_o = phi_o < 0.0 ? phi_o + float(PREFILTER_PHI_O) : phi_o;
  vec4 at = vec4(theta_n, phi_n, min(theta_o, float(PREFILTER_THETA_O - 1u)), phi_o);
  vec4 base = floor(at);
  vec4 part = at - base;
  vec4 sum = vec4(0.0);
  for (uint corner = 0u; corner < 16u; ++corner) {
    uvec4 step = uvec4(corner & 1u, corner >> 1 & 1u, corner >> 2 & 1u, corner >> 3);
    vec4 weights = mix(1.0 - part, part, vec4(step));
    uvec4 index = uvec4(base) + step;
    uint i_n = min(index.x, PREFILTER_THETA_N - 1u) * PREFILTER_PHI_N + index.y % PREFILTER_PHI_N;
    uint i_o = min(index.z, PREFILTER_THETA_O - 1u) * PREFILTER_PHI_O + index.w % PREFILTER_PHI_O;
    sum += weights.x * weights.y * weights.z * weights.w * prefiltered[i_n * PREFILTER_THETA_O * PREFILTER_PHI_O + i_o];
  }
  return sum;
}

vec3 glint_radiance(GlintSurface surface) {
  vec3 n = surface.normal;
  vec3 o = surface.o;
  float o_n = dot(o, n);
  mat3 to_local = frame_about(n);
  vec3 o_local = o * to_local;

  float area = footprint_area(surface.uv_dx, surface.uv_dy);
  float expected = area * flakes;
  // Written so that a footprint that is no number is macro too, where the area does not matter.
  bool macro = !(expected <= macro_above) || area < 1e-18;
  bool micro = !macro && expected < micro_below;
  vec2 side_x = surface.uv_dx;
  vec2 side_y = surface.uv_dy;
  vec2 wrapped = within_cell(surface.uv);
  vec2 corner = wrapped - 0.5 * (side_x + side_y);

  // Source 0 is the environment, the others are the lights. `each` is what a flake adds if it is lit for sure, before the
  // division by a sigma N.
  vec3 radiance = vec3(0.0);
  float all_flakes = expected;
  bool gathered = false;
  uint sources = 1u + light_count();
  for (uint source = has_environment() ? 0u : 1u; source < sources; ++source) {
    float probability = 0.0;
    vec3 each = vec3(0.0);
    if (source == 0u) {
      // L-hat holds P already.
      vec4 table = prefiltered_at(environment_from_scene(n), environment_from_scene(o));
      probability = table.w;
      each = frame.environment.z * schlick(surface.f0, o_n) * table.rgb;
    } else if ((surface.shadowed >> (source - 1u) & 1u) == 0u) {
      Arrival arrival = arrival_at(lights[source - 1u], surface.position);
      vec3 i = arrival.direction;
      float i_n = dot(i, n);
      if (i_n > 0.0) {
        probability = accumulated_probability(i * to_local, o_local);
        float i_h = half_vector_cosine(i, o);
        float shadowing = beckmann_g1_over_cosine(i_n, alpha) * beckmann_g1_over_cosine(o_n, alpha);
        float left_out = cosine == 1u ? i_n : 1.0;
        each = arrival.irradiance * schlick(surface.f0, i_h) * (i_h * shadowing * left_out * probability);
      }
    }
    if (each != vec3(0.0)) {
      // Eq. 18 (meso and macro), Eq. 20 (micro), Eq. 21 (lights).
      float count = expected;
      if (micro) {
        count = probability > 0.0 ? flakes_below(probability, corner, side_x, side_y, expected) / probability : 0.0;
      } else if (!macro) {
        if (!gathered) {
          all_flakes = flakes_below(ALL, corner, side_x, side_y, expected);
          gathered = true;
        }
        count = all_flakes;
      }
      radiance += each * (macro ? 1.0 / solid_angle : count / (area * solid_angle * flakes));
    }
  }
  return radiance;
}
