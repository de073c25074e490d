// Flakes under an environment by two moments: the mean of what one flake shows and the mean of its square, and a law for
// what a footprint of them shows.
//
// Flake k shows Y_k = w_k b_k L_k: its weight w = 1 / (m.n), its share b of Cook and Torrance's BRDF, and the radiance L, averaged
// over its cone, from where it mirrors. A footprint in which n flakes are expected and K are shows (Y_1 + ... + Y_K) / n. The
// flakes are independent, so for any environment
//   given K, the mean is K E[Y] / n and the variance K (E[Y^2] - E[Y]^2) / n^2,
// and with K Poisson the mean is E[Y] and the variance E[Y^2] / n: a constant environment sparkles by the count alone, and
// no number of flakes has another mean. K is drawn by its own law, exactly. The sum of K is drawn from the gamma law of that
// mean and variance: it is not negative, leans to the right as sums of rare bright flakes do, is closed under addition as
// K grows, and becomes K E[Y] / n itself where all flakes show the same.
//
// E[Y] and E[Y^2] are sums over a few normals m_j that share the distribution evenly, each with its own w and b, and with the radiance
// about where it mirrors o from tables of blurred radiance (passes/moments). The slopes of all flakes are a Gaussian of variance
// alpha^2 / 2 an axis; those of the m_j have the part v of that. What is left is the blur. A tables' lobe is round, while mirroring
// at the angle theta shortens slopes across the plane of incidence by cos theta, so that a round lobe of roughness a stands for slopes
// of variance a^2 / 2 in that plane and a^2 / (2 cos^2 theta) across it: with a = alpha sqrt(1 - v) cos theta the m_j stay as they are
// across the plane, and in it are stretched by sqrt((1 - (1 - v) cos^2 theta) / v). A steeper facet turns less for a change
// of its slope, in the mean of both axes by the cosine of its own angle to the power 3/2. One normal alone is the split sum.
#ifndef TWO_MOMENTS_GLSL
#define TWO_MOMENTS_GLSL
#include "shared/binomial.glsl"
#include "shared/hash.glsl"
#include "shared/microfacet.glsl"
#include "shared/smooth_lobe.glsl"

const float RINGS_DRAWN_IN = 0.8; // Squared; the blur makes up for it.
const float LEAST_COSINE = 0.2; // Nearer the horizon lobes are blurred as here: few normals would leave gaps.

// Of what one flake shows.
struct FlakeMoments {
  vec3 first; // E[Y].
  vec3 second; // E[Y^2], channel by channel.
};

// w b: what a flake of the unit normal `facet` shows of light from where it mirrors o, and that direction. Masking is that
// of the mirrored direction, as in methods/flakes.glsl.
vec3 flake_share(vec3 facet, vec3 n, vec3 o, vec3 f0, float alpha, out vec3 mirrored) {
  float o_m = dot(o, facet);
  mirrored = 2.0 * o_m * facet - o;
  float r_n = dot(mirrored, n);
  if (o_m <= 0.0 || r_n <= 0.0) {
    return vec3(0.0);
  }
  float shadowing = beckmann_g1_over_cosine(r_n, alpha) * r_n * beckmann_g1_over_cosine(dot(o, n), alpha);
  return schlick(f0, o_m) * (o_m * shadowing / dot(facet, n));
}

// A table about a direction as a lobe of this roughness blurs it. Two layers are mixed so that the variance of slopes, in proportion
// to alpha^2, is right: mixed evenly in the spacing of the layers they would blur too much, which shows near bright edges.
vec3 blurred_moment(texture2DArray moment, vec3 towards, float alpha) {
  float layer = sqrt(clamp(alpha, 0.0, 1.0)) * float(SPECULAR_LAYERS - 1u);
  float below = min(floor(layer), float(SPECULAR_LAYERS - 2u));
  vec2 low_high = vec2(below, below + 1.0) / float(SPECULAR_LAYERS - 1u);
  vec2 variances = low_high * low_high * low_high * low_high;
  float part = clamp((alpha * alpha - variances.x) / (variances.y - variances.x), 0.0, 1.0);
  vec2 uv = equirect_from(towards);
  vec3 low = textureLod(sampler2DArray(moment, linear_wrap_u), vec3(uv, below), 0.0).rgb;
  vec3 high = textureLod(sampler2DArray(moment, linear_wrap_u), vec3(uv, below + 1.0), 0.0).rgb;
  return mix(low, high, part);
}

// Squared slope, over alpha^2, of the normals on a ring: the middle of its share of them, drawn in a little, so that the blurs
// overlap.
float ring_slope2(uint ring, uint rings) {
  return -RINGS_DRAWN_IN * log(1.0 - (float(ring) + 0.5) / float(rings));
}

// By `rings` times `sectors` normals, or by one in the middle where there is no ring.
FlakeMoments flake_moments(
  texture2DArray first_moment, texture2DArray second_moment, mat3 from_local, vec3 o, vec3 f0, float alpha, uint rings,
  uint sectors
) {
  float spread = 0.0;
  for (uint ring = 0u; ring < rings; ++ring) {
    spread += ring_slope2(ring, rings) / float(rings);
  }
  vec3 local = o * from_local;
  float cosine = clamp(local.z, LEAST_COSINE, 1.0);
  float across = dot(local.xy, local.xy);
  vec2 incidence = across > 1e-12 ? local.xy * inversesqrt(across) : vec2(1.0, 0.0);
  // One normal blurs by as large an ellipse as it should, if round.
  float blur = rings > 0u ? alpha * sqrt(1.0 - spread) * cosine : alpha * sqrt(cosine);
  float stretch = rings > 0u ? sqrt((1.0 - (1.0 - spread) * cosine * cosine) / spread) : 1.0;
  uint count = max(rings * sectors, 1u);
  FlakeMoments sum = FlakeMoments(vec3(0.0), vec3(0.0));
  for (uint index = 0u; index < count; ++index) {
    uint ring = index / max(sectors, 1u);
    float radius = rings > 0u ? alpha * sqrt(ring_slope2(ring, rings)) : 0.0;
    // Rings are turned against each other.
    float turn = 2.0 * PI * (float(index % max(sectors, 1u)) + 0.5 * float(ring & 1u)) / float(max(sectors, 1u));
    vec2 slope = radius * (stretch * cos(turn) * incidence + sin(turn) * vec2(-incidence.y, incidence.x));
    vec3 normal = normalize(vec3(slope, 1.0));
    vec3 facet = from_local * normal;
    vec3 mirrored;
    vec3 share = flake_share(facet, from_local[2], o, f0, alpha, mirrored);
    vec3 towards = environment_from_scene(mirrored);
    float lobe = blur * normal.z * sqrt(normal.z);
    sum.first += share * blurred_moment(first_moment, towards, lobe);
    sum.second += share * share * blurred_moment(second_moment, towards, lobe);
  }
  float scale = frame.environment.z;
  return FlakeMoments(scale / float(count) * sum.first, scale * scale / float(count) * sum.second);
}

// A number of the gamma law of this shape and of mean 1, from two words, the same for all shapes. Of shape k + 1 by the cube of
// Wilson and Hilferty (1931), whose mean is within .14 % and whose variance within .4 % where k = 0 and nearer for any other; times
// u^(1/k), which makes it one of shape k, exactly (Stuart 1962).
float gamma_of_mean_1(float shape, uvec2 words) {
  float k = clamp(shape, 1e-6, 1e8);
  float v = (float(words.x) + 0.5) * 2.3283064e-10;
  float z = normal_exceeded(clamp(v, 1e-9, 0.99999994));
  float part = 1.0 / (9.0 * (k + 1.0));
  float cube = max(1.0 - part + z * sqrt(part), 0.0);
  float u = unit_from(words.y);
  // (k + 1) / k is the mean of shape k + 1 over that of shape k.
  return (k + 1.0) / k * (cube * cube * cube) * exp(log(u) / k);
}

// What a footprint of `count` flakes shows, of which `expected` are on average: drawn anew for other words.
vec3 drawn_radiance(FlakeMoments moments, float count, float expected, uvec2 words) {
  vec3 variance = max(moments.second - moments.first * moments.first, vec3(0.0));
  vec3 shape = count * moments.first * moments.first / max(variance, vec3(1e-30));
  vec3 sum = vec3(
    gamma_of_mean_1(shape.r, words), gamma_of_mean_1(shape.g, words), gamma_of_mean_1(shape.b, words)
  );
  return count > 0.0 ? count / expected * moments.first * sum : vec3(0.0);
}

#endif
