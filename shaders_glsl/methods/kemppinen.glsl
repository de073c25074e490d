// Kemppinen et al. 2025: "Evaluating and Sampling Glinty NDFs in Constant Time": flakes are points in texture space and
// on a disk of normals; the 16 about the footprint and the half vector on each of two levels are visited.
//
// As printed, or with the slips that engine/render/src/methods/kemppinen.rs names repaired.
#include "shared/footprint_ellipse.glsl"
#include "shared/hash.glsl"
#include "shared/lobe_light.glsl"

layout(push_constant) uniform Params {
  uint material; // Index of the material.
  float alpha; // Roughness.
  float solid_angle; // Of the reflection cone, in steradians: sigma.
  float alpha_g; // Roughness of a flake, or 0 to derive it from the cone.
  float root_count; // Square root of the number of flakes in a square of texture space.
  float filter_width; // Deviation of the pixel's Gaussian, in pixels: f.
  uint seed; // Of the flakes.
  uint ggx; // 1: normals by GGX; 0: by Beckmann.
  uint repaired; // 1 repairs the slips.
};

// Angular cells along an axis are 2^level: from two, which the neighbourhood covers, to as many as floats tell apart.
const float MIN_LEVEL = 1.0;
const float MAX_LEVEL = 21.0;
const float ROULETTE = 0.1; // Half the part of a level in which a point appears.

// The error function by Abramowitz and Stegun 1964, 7.1.26: within 1.5e-7.
vec2 error_function(vec2 x) {
  vec2 t = 1.0 / (1.0 + 0.3275911 * abs(x));
  vec2 series = t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))));
  return sign(x) * (1.0 - series * exp(-min(x * x, vec2(80.0))));
}

// Mass inside a box of a round Gaussian about `center`.
float box_mass(vec2 low, vec2 high, vec2 center, float deviation) {
  float scale = 0.70710678 / deviation;
  vec2 sides = 0.5 * (error_function((high - center) * scale) - error_function((low - center) * scale));
  return sides.x * sides.y;
}

// Where between levels a point appears. As printed anywhere, so that a tenth of a level's points appear at once as it
// begins; repaired, between the ends.
float roulette_from(float random) {
  return repaired == 1u ? mix(ROULETTE, 1.0 - ROULETTE, random) : random;
}

// The integral of smoothstep from 0 to x.
float smoothstep_integral(float x) {
  return x >= 1.0 ? x - 0.5 : (x > 0.0 ? x * x * x * (1.0 - 0.5 * x) : 0.0);
}

// Share of a level's points that the roulette lets through. The paper takes the weight, which it is but for its ends.
float points_there(float weight) {
  if (repaired == 0u) {
    return weight;
  }
  float from = (weight - 1.0 + 2.0 * ROULETTE) / (2.0 * ROULETTE);
  float to = weight / (2.0 * ROULETTE);
  return (smoothstep_integral(to) - smoothstep_integral(from)) * 2.0 * ROULETTE / (1.0 - 2.0 * ROULETTE);
}

// Where a normal lies on the disk, and how much of the disk a steradian about it covers.
struct Warped {
  vec2 place; // Inside the disk of radius 1/2 about (1/2, 1/2).
  float d; // D, in 1/sr.
  float disk_per_steradian; // Its Jacobian.
};

// The normal's slope is sent to the direction v of a cosine lobe by equal probability, D (h.n) dh = v_z dv / pi, and v to
// the disk by equal area. For GGX v is the half vector stretched by 1 / alpha; for Beckmann v_z = exp(-tan^2 / (2 alpha^2)).
Warped warped_normal(vec3 local) {
  float alpha2 = alpha * alpha;
  float sin2 = dot(local.xy, local.xy);
  float cos2 = local.z * local.z;
  float tan2 = sin2 / (alpha2 * cos2);
  Warped warped;
  float one_less_v_z;
  float d_over_v_z;
  if (ggx == 1u) {
    float root = sqrt(1.0 + tan2);
    one_less_v_z = tan2 / (root * (1.0 + root));
    warped.d = 1.0 / (PI * alpha2 * cos2 * cos2 * (1.0 + tan2) * (1.0 + tan2));
    d_over_v_z = warped.d * root;
  } else {
    float half_tan2 = 0.5 * tan2;
    float v_z = exp(-half_tan2);
    one_less_v_z = half_tan2 < 0.1
      ? half_tan2 * (1.0 - half_tan2 * (0.5 - half_tan2 * (1.0 / 6.0 - half_tan2 * (1.0 / 24.0 - half_tan2 / 120.0))))
      : 1.0 - v_z;
    d_over_v_z = v_z / (PI * alpha2 * cos2 * cos2);
    warped.d = d_over_v_z * v_z;
  }
  warped.disk_per_steradian = PI * d_over_v_z * local.z / 8.0;
  // v_xy / sqrt(1 + v_z) has the length sqrt(1 - v_z).
  vec2 outwards = sin2 > 1e-20 ? local.xy * inversesqrt(sin2) : vec2(0.0);
  warped.place = 0.5 + 0.5 * outwards * sqrt(one_less_v_z);
  return warped;
}

float glint_density(GlintSurface surface, vec3 i, vec3 h) {
  vec3 local = h * frame_about(surface.normal);
  if (!(local.z > 1e-4)) {
    return 0.0;
  }
  Warped normal_at = warped_normal(local);
  // D below what floats can share out adds no light.
  if (!(normal_at.d > 1e-30)) {
    return 0.0;
  }
  // The solid angle of a flake's response, sigma / (4 i.h), is that of 2 pi times the Gaussian's variance on the disk.
  float half_solid_angle = solid_angle / (4.0 * max(dot(i, h), 1e-4));
  float variance = alpha_g > 0.0
    ? PI * normal_at.d * alpha_g * alpha_g
    : half_solid_angle * normal_at.disk_per_steradian / (2.0 * PI);
  variance = clamp(variance, 1e-24, 1e6);
  float deviation = sqrt(variance);
  float inside = box_mass(vec2(0.0), vec2(1.0), normal_at.place, deviation);

  // Texture space in units in which there is one flake a square.
  Ellipse ellipse = footprint_ellipse(surface.uv_dx * root_count, surface.uv_dy * root_count);
  vec2 at = surface.uv * root_count;
  float along = ellipse.major * filter_width;
  float across = ellipse.minor * filter_width;
  float level = clamp(log2(along) + exp2(filter_width), MIN_LEVEL, MAX_LEVEL);
  float low_level = floor(level);

  float points = 0.0; // Of the visited, each Gaussian's greatest value being 1.
  float rest = 0.0; // What the others add on average.
  for (int upper = 0; upper < 2; ++upper) {
    float weight = upper == 0 ? 1.0 - (level - low_level) : level - low_level;
    float side = exp2(low_level + float(upper));
    vec2 normal_cell = clamp(floor(normal_at.place * side + 0.5), 1.0, side - 1.0) - 1.0;
    vec2 place_cell = floor(at / side + 0.5) - 1.0;
    uint level_key = hash(uint(low_level) + uint(upper), seed);
    for (uint point = 0u; point < 16u; ++point) {
      vec2 cell = place_cell + vec2(point & 1u, point >> 1 & 1u);
      vec2 angular_cell = normal_cell + vec2(point >> 2 & 1u, point >> 3);
      uvec2 x = words_of(cell.x);
      uvec2 y = words_of(cell.y);
      uint key = hash(uint(angular_cell.x), uint(angular_cell.y), hash(x.x, x.y, hash(y.x, y.y, level_key)));
      vec2 place = vec2(unit_from(mixed(key + 1u)), unit_from(mixed(key + 2u)));
      vec2 angular_place = vec2(unit_from(mixed(key + 3u)), unit_from(mixed(key + 4u)));
      float appears = roulette_from(unit_from(mixed(key + 5u)));
      vec2 away = (at / side - cell - place) * side;
      vec2 turned = vec2(dot(away, ellipse.direction) / along,
        (away.y * ellipse.direction.x - away.x * ellipse.direction.y) / across);
      vec2 angular_away = (normal_at.place - (angular_cell + angular_place) / side) / deviation;
      float exponent = min(0.5 * (dot(turned, turned) + dot(angular_away, angular_away)), 100.0);
      points += smoothstep(appears - ROULETTE, appears + ROULETTE, weight) * exp(-exponent);
    }
    vec2 low = normal_cell / side;
    float visited = box_mass(low, low + 2.0 / side, normal_at.place, deviation);
    rest += points_there(weight) * max(inside - visited, 0.0);
  }
  // Divided by variances one by one, and a pixel far inside a flake bounded, so that nothing leaves the range of floats.
  float peak = normal_at.d / variance / (4.0 * PI * PI) / max(along * across, 1e-24);
  float density = min(peak, 1e34) * points + normal_at.d * rest;
  return repaired == 1u ? density / max(inside, 1e-6) : density;
}

vec3 glint_radiance(GlintSurface surface) {
  return smooth_environment(surface, alpha) + lobe_under_lights(surface, alpha);
}
