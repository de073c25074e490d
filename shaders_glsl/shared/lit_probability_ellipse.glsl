// P(i, o, gamma) over the ellipse that the cone becomes in slope space where reflection is taken as linear, for Beckmann
// normals.
#ifndef LIT_PROBABILITY_ELLIPSE_GLSL
#define LIT_PROBABILITY_ELLIPSE_GLSL
#include "shared/constants.glsl"
#include "shared/error_function.glsl"

// Slopes of the normals that reflect i towards o and about it.
struct SlopeMap {
  vec2 slope; // Of h: the one towards o.
  vec3 spread; // J J', as xx, xy, yy, where J takes a small turn of o to a change of slope.
  float root_determinant; // |det J|.
  bool seen; // Whether h is above the horizon.
};

// With s = (i + o).xy / (i + o).z and w = o.xy - s o.z, J J' = (I + s s' - w w') / (i + o).z^2. Directions are unit vectors
// about n = +Z.
SlopeMap slope_map(vec3 i, vec3 o) {
  vec3 sum = i + o;
  float length2 = dot(sum, sum);
  SlopeMap map = SlopeMap(vec2(0.0), vec3(1.0, 0.0, 1.0), 1.0, length2 >= 1e-12 && sum.z > 0.0);
  if (map.seen) {
    float over_z = 1.0 / sum.z;
    vec2 s = sum.xy * over_z;
    vec2 w = o.xy - s * o.z;
    float over_z2 = over_z * over_z;
    map.slope = s;
    map.spread = over_z2 * vec3(1.0 + s.x * s.x - w.x * w.x, s.x * s.y - w.x * w.y, 1.0 + s.y * s.y - w.y * w.y);
    map.root_determinant = 0.5 * length2 * over_z2 * over_z;
  }
  return map;
}

// The Gaussian of slopes, widened by that which has the cone's variance.
float lit_probability_gaussian(vec3 i, vec3 o, float sin2_half_gamma, float alpha) {
  SlopeMap map = slope_map(i, o);
  if (!map.seen) {
    return 0.0;
  }
  vec3 covariance = sin2_half_gamma * map.spread + 0.5 * alpha * alpha * vec3(1.0, 0.0, 1.0);
  float determinant = covariance.x * covariance.z - covariance.y * covariance.y;
  vec2 s = map.slope;
  float square =
    (covariance.z * s.x * s.x - 2.0 * covariance.y * s.x * s.y + covariance.x * s.y * s.y) / determinant;
  return 2.0 * sin2_half_gamma * map.root_determinant * exp(-0.5 * square) * inversesqrt(determinant);
}

// The ellipse in its own axes.
struct SlopeEllipse {
  float half_long; // Half its longer axis.
  float half_short; // Half its shorter axis.
  vec2 center; // Along the longer axis and across it.
};

// The radius of the disk of the cone's solid angle is 2 sin(gamma / 2).
SlopeEllipse slope_ellipse(SlopeMap map, float sin2_half_gamma) {
  float difference = map.spread.x - map.spread.z;
  float mixed_part = 2.0 * map.spread.y;
  float both = length(vec2(difference, mixed_part));
  float larger = 0.5 * (map.spread.x + map.spread.z + both);
  // Twice the axis's angle is that of (difference, mixed part); halved without cancellation.
  vec2 along = difference >= 0.0 ? vec2(both + difference, mixed_part) : vec2(mixed_part, both - difference);
  float length2 = dot(along, along);
  along = length2 > 1e-20 ? along * inversesqrt(length2) : vec2(1.0, 0.0);
  float radius = 2.0 * sqrt(sin2_half_gamma);
  float root = sqrt(larger);
  vec2 center = vec2(dot(map.slope, along), along.x * map.slope.y - along.y * map.slope.x);
  return SlopeEllipse(radius * root, radius * map.root_determinant / root, center);
}

// The ellipse as a box of the same area.
float lit_probability_box(vec3 i, vec3 o, float sin2_half_gamma, float alpha) {
  SlopeMap map = slope_map(i, o);
  if (!map.seen) {
    return 0.0;
  }
  SlopeEllipse ellipse = slope_ellipse(map, sin2_half_gamma);
  vec2 reach = 0.5 * sqrt(PI) * vec2(ellipse.half_long, ellipse.half_short);
  vec2 center = ellipse.center / alpha;
  vec2 half_side = reach / alpha;
  return 0.25 * erf_about(center.x, half_side.x) * erf_about(center.y, half_side.y);
}

// Six strips along the ellipse, their places and widths by Gauss and Chebyshev (second kind), each with error functions.
float lit_probability_strips(vec3 i, vec3 o, float sin2_half_gamma, float alpha) {
  // Cosines and sines of k pi / 7.
  const float COSINES[3] = float[](0.9009688679024191, 0.6234898018587336, 0.2225209339563144);
  const float SINES[3] = float[](0.4338837391175581, 0.7818314824680298, 0.9749279121818236);
  SlopeMap map = slope_map(i, o);
  if (!map.seen) {
    return 0.0;
  }
  SlopeEllipse ellipse = slope_ellipse(map, sin2_half_gamma);
  float over_alpha = 1.0 / alpha;
  vec2 center = ellipse.center * over_alpha;
  float half_long = ellipse.half_long * over_alpha;
  float half_short = ellipse.half_short * over_alpha;
  float total = 0.0;
  for (int strip = 0; strip < 3; ++strip) {
    float reach = half_long * SINES[strip];
    float inside = 0.5 * erf_about(center.x, reach);
    float above = center.y + half_short * COSINES[strip];
    float below = center.y - half_short * COSINES[strip];
    total += SINES[strip] * inside * (exp(-above * above) + exp(-below * below));
  }
  return total * half_short * sqrt(PI) / 7.0;
}

#endif
