// Deliot and Belcour 2023: "Real-Time Rendering of Glinty Appearances using Distributed Binomial Laws on Anisotropic
// Grids": lit flakes are counted on four grids about the pixel's footprint, by a gated normal number for each vertex.
//
// As printed, or with the slips that engine/render/src/methods/deliot_belcour.rs names repaired.
#include "shared/deliot_belcour_noise.glsl"
#include "shared/footprint_ellipse.glsl"
#include "shared/gated_binomial.glsl"
#include "shared/hash.glsl"
#include "shared/lobe_light.glsl"

layout(std430, binding = 52) readonly buffer Noise { uvec4 noise[]; };
layout(push_constant) uniform Params {
  uint material; // Index of the material.
  float alpha; // Roughness.
  float solid_angle; // Of the reflection cone, in steradians: sigma.
  float normals; // The integral of D over the hemisphere: S_D.
  float peak; // The greatest value of D.
  float microfacet_roughness; // R, or 0 to derive it from the cone.
  float log_density; // Natural logarithm of the median number of flakes in a square of texture space.
  float density_randomization; // Standard deviation of that logarithm.
  float screen_space_scale; // Width of the grids' cells over the footprint's shorter half axis.
  uint seed; // Of the flakes.
  uint repaired; // 1 repairs the slips.
};

// A grid: a corner of the tetrahedron that holds the footprint.
struct Grid {
  int level; // Its cells are 2^level wide,
  int stretch; // and 2^stretch times as long.
  float degrees; // Angle of their longer side from +v.
  uint turn; // The same in whole steps of its ratio: an angle has one name.
};

// The probit by Abramowitz and Stegun 1964, 26.2.23: within 4.5e-4.
float probit(float u) {
  float tail = min(u, 1.0 - u);
  float t = sqrt(-2.0 * log(tail));
  float z = t - (2.515517 + t * (0.802853 + t * 0.010328)) / (1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308)));
  return u < 0.5 ? -z : z;
}

// Share of the flakes of one grid that are lit, times the grid's weight.
float lit_share(Grid grid, float weight, vec2 uv, vec2 slope, float p) {
  float angle = radians(grid.degrees);
  vec2 turned = vec2(cos(angle) * uv.x - sin(angle) * uv.y, sin(angle) * uv.x + cos(angle) * uv.y);
  vec2 stretched = turned * exp2(vec2(-float(grid.level), -float(grid.level + grid.stretch)));
  float area = exp2(float(2 * grid.level + grid.stretch));
  // Equilateral triangles.
  vec2 skewed = vec2(stretched.x - stretched.y * 0.57735027, stretched.y * 1.15470054);
  vec2 base = floor(skewed);
  vec2 part = clamp(skewed - base, 0.0, 1.0);
  bool upper = part.x + part.y > 1.0;
  vec3 weights = upper
    ? vec3(part.x + part.y - 1.0, 1.0 - part.y, 1.0 - part.x)
    : vec3(1.0 - part.x - part.y, part.x, part.y);
  uint grid_key = hash(uint(grid.level), uint(grid.stretch), hash(grid.turn, seed));
  float share = 0.0;
  for (int corner = 0; corner < 3; ++corner) {
    vec2 step = corner == 0 ? vec2(upper ? 1.0 : 0.0) : (corner == 1 ? vec2(1.0, 0.0) : vec2(0.0, 1.0));
    vec2 vertex = base + step;
    uvec2 x = words_of(vertex.x);
    uvec2 y = words_of(vertex.y);
    uint key = hash(x.x, x.y, hash(y.x, y.y, grid_key));
    float exponent = log_density + density_randomization * probit(unit_from(mixed(key + 1u)));
    float n = flakes_in_cell(repaired == 1u ? exponent : max(exponent, 0.0), area);
    vec2 offset = vec2(unit_from(mixed(key + 2u)), unit_from(mixed(key + 3u)));
    vec2 at = slope + offset * float(DELIOT_BELCOUR_NOISE_SIZE);
    vec2 cell = floor(at);
    vec2 inside = at - cell;
    uvec2 texel = uvec2(cell) & (DELIOT_BELCOUR_NOISE_SIZE - 1u);
    uvec4 packed = noise[texel.y * DELIOT_BELCOUR_NOISE_SIZE + texel.x];
    vec2 n00 = unpackHalf2x16(packed.x);
    vec2 n10 = unpackHalf2x16(packed.y);
    vec2 n01 = unpackHalf2x16(packed.z);
    vec2 n11 = unpackHalf2x16(packed.w);
    float weighted = n * weight;
    vec4 lit = gated_binomial(
      weighted, p, vec4(n00.y, n10.y, n01.y, n11.y), vec4(n00.x, n10.x, n01.x, n11.x), repaired == 1u
    );
    float blended = mix(mix(lit.x, lit.y, inside.x), mix(lit.z, lit.w, inside.x), inside.y);
    share += n > 0.0 ? weights[corner] * blended / n : 0.0;
  }
  return share;
}

// Barycentric coordinates of a point in the tetrahedron of these corners.
vec4 barycentric(mat4x3 corners, vec3 point) {
  vec3 a = corners[1] - corners[0];
  vec3 b = corners[2] - corners[0];
  vec3 c = corners[3] - corners[0];
  vec3 p = point - corners[0];
  vec3 others = vec3(dot(p, cross(b, c)), dot(a, cross(p, c)), dot(a, cross(b, p))) / dot(a, cross(b, c));
  return max(vec4(1.0 - others.x - others.y - others.z, others), 0.0);
}

// The tetrahedron of grids about a footprint: corners are (part of the angle's bin, ratio, level). Twice as many angles
// stand at twice the ratio; below the ratio 2 there is one grid without an angle, so that the prism ends in an edge.
mat4x3 tetrahedron(bool round_end, inout vec3 at) {
  float u = 1.0 - at.y;
  vec3 a = vec3(0.0, 1.0, 0.0);
  vec3 b = vec3(0.0, 0.0, 0.0);
  vec3 up = vec3(0.0, 0.0, 1.0);
  if (round_end) {
    vec3 c = vec3(1.0, 1.0, 0.0);
    at.x *= at.y;
    if (at.z <= u) {
      return mat4x3(b, a, c, b + up);
    }
    return at.z - u > at.x ? mat4x3(a, b + up, a + up, c + up) : mat4x3(c + up, b + up, c, a);
  }
  vec3 c = vec3(0.5, 1.0, 0.0);
  vec3 d = vec3(1.0, 0.0, 0.0);
  vec3 e = vec3(1.0, 1.0, 0.0);
  if (at.x < 0.5 && 2.0 * at.x < at.y) {
    if (at.z <= u) {
      return mat4x3(b, a, c, b + up);
    }
    return at.z - u > 2.0 * at.x ? mat4x3(a, a + up, c + up, b + up) : mat4x3(c, a, c + up, b + up);
  }
  if (2.0 - 2.0 * at.x > at.y) {
    if (at.z >= u) {
      return mat4x3(c, b + up, c + up, d + up);
    }
    return at.z > at.x - 0.5 * at.y ? mat4x3(b, b + up, d + up, c) : mat4x3(d, b, c, d + up);
  }
  if (at.z <= u) {
    return mat4x3(d, e, c, d + up);
  }
  return at.z > 2.0 * at.x - 1.0 ? mat4x3(c, e + up, c + up, d + up) : mat4x3(e, d + up, c, e + up);
}

float glint_density(GlintSurface surface, vec3 i, vec3 h) {
  vec3 n = surface.normal;
  float d = beckmann_d(h, n, alpha);
  // `spread`: D over the probability that a flake is lit. R is wide: no more of them than all can be lit.
  float half_solid_angle = solid_angle / (4.0 * max(dot(i, h), 1e-4));
  bool printed = microfacet_roughness > 0.0;
  float roughness = printed ? microfacet_roughness : sqrt(half_solid_angle);
  float spread = printed
    ? 1.0 / (microfacet_roughness * PI * alpha * alpha)
    : max(normals / half_solid_angle, peak);
  float p = min(d / spread, 1.0);
  // With so small a chance there is no light to count either.
  if (!(p > 1e-30)) {
    return 0.0;
  }
  vec2 slope = abs((h * frame_about(n)).xy) / roughness;

  Ellipse ellipse = footprint_ellipse(surface.uv_dx, surface.uv_dy);
  float ratio = ellipse.major / ellipse.minor;
  float level = log2(ellipse.minor * screen_space_scale * 0.5);
  int low_level = repaired == 1u ? int(floor(level)) : int(level);
  int low_stretch = max(int(floor(log2(ratio))), 0);
  float low_ratio = exp2(float(low_stretch));
  bool round_end = low_stretch == 0;
  // Angles of the lower ratio stand 180 / 2^(stretch + 2) degrees apart, those below the ratio 2 like those of 2.
  int angle_bits = max(low_stretch, 1) + 2;
  float degrees_from_v = degrees(atan(ellipse.direction.x, ellipse.direction.y));
  degrees_from_v = degrees_from_v < 0.0 ? degrees_from_v + 180.0 : degrees_from_v;
  float bin = degrees_from_v * exp2(float(angle_bits)) / 180.0;
  float low_bin = floor(bin);
  vec3 at = clamp(vec3(bin - low_bin, ratio / low_ratio - 1.0, level - floor(level)), 0.0, 1.0);
  mat4x3 corners = tetrahedron(round_end, at);
  vec4 weights = barycentric(corners, at);

  float share = 0.0;
  for (int corner = 0; corner < 4; ++corner) {
    vec3 place = corners[corner];
    Grid grid;
    grid.level = low_level + int(place.z);
    grid.stretch = low_stretch + int(place.y);
    // The grid without an angle has one name; others count their own steps, twice as many at twice the ratio.
    int bits = max(grid.stretch, 1) + 2;
    float turn = (low_bin + place.x) * exp2(float(bits - angle_bits));
    uint turns = 1u << uint(bits);
    grid.turn = grid.stretch == 0 ? 0u : uint(turn + 0.5) & (turns - 1u);
    grid.degrees = float(grid.turn) * 180.0 / float(turns);
    if (weights[corner] > 1e-6) {
      share += lit_share(grid, weights[corner], surface.uv, slope, p);
    }
  }
  return share * spread;
}

vec3 glint_radiance(GlintSurface surface) {
  return smooth_environment(surface, alpha) + lobe_under_lights(surface, alpha);
}
