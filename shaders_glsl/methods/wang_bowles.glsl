// B. Wang and H. Bowles 2016: "A Robust and Flexible Real-Time Sparkle Effect": a jittered grid in space, cut by the surface.
//
// Sparkles know nothing of the light: they are multiplied by a smooth lobe under the lights. As printed, what would be a
// division by 0 is no sparkle; repaired, it does not come to that.
#include "shared/hash.glsl"
#include "shared/lobe_light.glsl"
#include "shared/sparkle_grid.glsl"
#include "shared/texture_density.glsl"

layout(push_constant) uniform Params {
  uint material; // Index of the material.
  uint seed; // Of the sparkles.
  float alpha; // Roughness of the lobe that the sparkles are multiplied by.
  float lit_flakes; // Lit in a square of texture space, where the lobe is brightest.
  float unit; // Metres in a unit of length.
  float scale; // Cells in a unit of length where the level is 1.
  float squared_radius; // Of a sparkle, in cells: the paper's 1 - sparkle_size.
  float twinkle; // Cells by which the view shifts the grid.
  uint layers; // Grids on top of each other.
  uint round_on_screen; // 1 stretches sparkles along the view, so that they look round.
  uint repaired; // 1 removes the degeneracies.
};

const float LARGEST_INDEX = 1073741824.0; // Cells are told apart to this index, 2^30.
const float LEAST_OCCUPANCY = 1e-6; // Of cells by sparkles.
const float LONGEST_REACH = 0.75; // From a sparkle to where the eight nearest cells may not hold it any more, in cells.
const uint REPAIRED_CELLS = 16u; // Eight cells on two levels.

// What the lobe is multiplied by; 1 on average.
float sparkle;

float sparkle_at(GlintSurface surface) {
  float metres = length(surface.position - frame.eye.xyz);
  float lit = lit_flakes * texture_density(surface);
  float radius = sqrt(squared_radius);
  // Mean over space of 1 - d^2 / r^2 within a ball of radius r is 8 pi / 15 r^3.
  float mean_of_ball = 8.0 * PI / 15.0 * squared_radius * radius;

  float facing = dot(surface.o, surface.normal);
  vec3 tangent = surface.o - facing * surface.normal;
  float flattened = 1.0;
  float along_tangent = 0.0;
  bool defined = true;
  if (round_on_screen == 1u) {
    flattened = abs(facing);
    if (repaired == 1u) {
      // Where a sparkle would reach past the eight nearest cells, it is stretched no further.
      float least = min(radius / LONGEST_REACH, 1.0);
      along_tangent = sparkle_stretch(facing, least);
      flattened = max(flattened, least);
    } else {
      float tangent2 = dot(tangent, tangent);
      defined = tangent2 > 0.0;
      along_tangent = defined ? (flattened - 1.0) / tangent2 : 0.0;
    }
  }

  // Levels of the grid: steps of a factor 2 in distance.
  float step = log2(0.3 * metres / unit + 3.0);
  float lower = floor(step);
  uint cells_a_layer = repaired == 1u ? REPAIRED_CELLS : 1u;
  float sum = 0.0;
  for (uint at = 0u; at < layers * cells_a_layer && defined; ++at) {
    uint layer = at / cells_a_layer;
    uint corner = at % cells_a_layer;
    uint upper = corner >> 3;
    int level = int(lower) + int(upper);
    float weight = 1.0;
    if (repaired == 1u) {
      level = max(level, 2);
      weight = upper == 1u ? step - lower : 1.0 - (step - lower);
    }
    // As printed the nearest level is 0, where the grid would be infinitely fine.
    float level_z = repaired == 1u ? sparkle_distance(level) : 0.1 * ldexp(1.0, level) - 0.2;
    vec3 turned = fract(surface.o * level_z);
    bool turns = repaired == 1u || dot(turned, turned) > 0.0;
    if (weight > 0.0 && level_z > 0.0 && turns) {
      vec3 shift = repaired == 1u ? sparkle_shift(surface.o, level_z) : turned * inversesqrt(dot(turned, turned));
      float cells_a_metre = scale * 0.12 / (level_z * unit);
      // At even steps between two cells: a plane along one grid, which may pass between sparkles, does not along the next.
      vec3 offset = vec3(float(layer) / float(layers));
      vec3 place = cells_a_metre * surface.position + twinkle * shift + offset;
      vec3 corner_of_cell = vec3(float(corner & 1u), float(corner >> 1 & 1u), float(corner >> 2 & 1u));
      vec3 cell = repaired == 1u ? floor(place - 0.5) + corner_of_cell : floor(place);
      ivec3 index = ivec3(clamp(cell, -LARGEST_INDEX, LARGEST_INDEX));
      uint key = hash(uint(index.x), uint(index.y), hash(uint(index.z), hash(uint(level), layer, seed)));
      vec3 jitter = vec3(unit_from(hash(key, 1u)), unit_from(hash(key, 2u)), unit_from(hash(key, 3u)));
      vec3 from_sparkle = place - cell - (0.25 + 0.5 * jitter);
      from_sparkle += tangent * (along_tangent * dot(from_sparkle, tangent));
      float brightness = max(1.0 - dot(from_sparkle, from_sparkle) / squared_radius, 0.0);
      // A surface passes within the radius of 2 r sparkles for each face of a cell.
      float occupancy = lit / (cells_a_metre * cells_a_metre * 2.0 * radius);
      occupancy = clamp(occupancy, LEAST_OCCUPANCY, 1.0);
      sum += unit_from(hash(key, 4u)) < occupancy ? weight * brightness / occupancy : 0.0;
    }
  }
  return sum * flattened / (mean_of_ball * float(layers));
}

float glint_density(GlintSurface surface, vec3 i, vec3 h) {
  return sparkle * beckmann_d(h, surface.normal, alpha);
}

vec3 glint_radiance(GlintSurface surface) {
  sparkle = sparkle_at(surface);
  return smooth_environment(surface, alpha) + lobe_under_lights(surface, alpha);
}
