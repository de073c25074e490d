// The flakes: how many lie in each node of a quadtree over a square of texture space, where, and with which normal
// (engine/design/0007-flake-set.md).
//
// Everything follows from integer hashes by integer operations and by sums and products of floats that are rounded one
// by one (`precise`), so that every device and the oracle see the same flakes, bit for bit. Needs shaderInt64.
#ifndef FLAKE_SET_GLSL
#define FLAKE_SET_GLSL
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "shared/hash.glsl"
#include "shared/integer_edges.glsl"

const uint FLAKES_A_LEAF = 4u; // Leaves are on the first level where there are at most so many flakes a node on average.
const uint EXACT_HALVING = 64u; // Up to so many flakes are parted by a bit each, more by a rounded normal.
const uint FIRST_FLAKE_DRAW = 6u; // A leaf's first draws belong to its split; each flake takes four after that.

// Names a node; its random words are drawn from it. Two words, as a level has up to 2^38 nodes.
uvec2 node_key(uint level, uint x, uint y, uint seed) {
  return uvec2(hash(x, y, hash(level, seed)), hash(y, x, hash(level, ~seed)));
}

// Random word `index` of a node.
uint draw(uvec2 key, uint index) {
  return mixed(key.x + mixed(key.y + index));
}

// -ln(word / 2^32) of the upper 24 bits of any word within 2e-7 relative, 0 taken as 1: no division, no library function.
float minus_log(uint word) {
  uint bits = max(word, 1u);
  int exponent = findMSB(bits);
  // 1 <= mantissa < 2, the upper 24 bits.
  precise float mantissa = float((bits << (31 - exponent)) >> 8) * (1.0 / 8388608.0);
  if (mantissa > 1.41421354) {
    mantissa = mantissa * 0.5;
    exponent += 1;
  }
  precise float x = mantissa - 1.0;
  precise float series = -0.07638592;
  series = series * x + 0.1291417;
  series = series * x - 0.13240843;
  series = series * x + 0.14180079;
  series = series * x - 0.16609127;
  series = series * x + 0.20002072;
  series = series * x - 0.25001585;
  series = series * x + 0.33333324;
  series = series * x - 0.49999988;
  series = series * x + 1.0;
  precise float log_mantissa = series * x;
  precise float result = float(32 - exponent) * 0.6931472 - log_mantissa;
  return max(result, 0.0);
}

// 1 / sqrt(x) for positive normal x within 2.4e-7 relative: four steps of Newton from the exponent halved.
float inverse_root(float x) {
  precise float y = uintBitsToFloat(0x5f3759dfu - (floatBitsToUint(x) >> 1));
  precise float half_x = 0.5 * x;
  for (int step = 0; step < 4; ++step) {
    precise float square = y * y;
    precise float rest = 1.5 - half_x * square;
    y = y * rest;
  }
  return y;
}

// Two independent normal numbers of mean 0 and variance 1 (Box and Muller 1958). The first word gives the radius, the
// second the angle: its upper three bits the eighth of the turn, the next 24 the place in it.
vec2 normal_pair(uint radius_word, uint angle_word) {
  precise float squared = 2.0 * minus_log(radius_word);
  precise float radius = squared > 1e-12 ? squared * inverse_root(squared) : 0.0;
  precise float angle = (float((angle_word >> 5) & 0xffffffu) + 0.5) * 4.6816675e-8; // pi/4 / 2^24
  precise float z = angle * angle;
  precise float sine = -1.9503963e-4;
  sine = sine * z + 8.332036e-3;
  sine = sine * z - 0.1666665;
  sine = sine * z + 1.0;
  sine = sine * angle;
  precise float cosine = 2.437988e-5;
  cosine = cosine * z - 1.3886619e-3;
  cosine = cosine * z + 4.1666617e-2;
  cosine = cosine * z - 0.5;
  cosine = cosine * z + 1.0;
  uint eighth = angle_word >> 29;
  bool swapped = (eighth & 1u) != 0u;
  precise float x = radius * (swapped ? sine : cosine);
  precise float y = radius * (swapped ? cosine : sine);
  return vec2((eighth & 2u) != 0u ? -x : x, (eighth & 4u) != 0u ? -y : y);
}

// Binomial(n, 1/2) from two random words. Beyond `EXACT_HALVING` a normal number, its kurtosis corrected (Cornish and
// Fisher 1938) and its variance less the 1/12 that rounding adds (Sheppard 1898).
uint64_t half_of(uint64_t n, uint first_word, uint second_word) {
  if (n <= uint64_t(EXACT_HALVING)) {
    uint count = uint(n);
    uint low = low_bits(count);
    uint high = low_bits(max(count, 32u) - 32u);
    return uint64_t(bitCount(first_word & low) + bitCount(second_word & high));
  }
  precise float variance = 0.25 * float(n) - 0.083333336;
  precise float over_deviation = inverse_root(variance);
  precise float deviation = variance * over_deviation;
  precise float z = normal_pair(first_word, second_word).x;
  precise float excess = z * z - 3.0;
  precise float correction = excess * (over_deviation * over_deviation);
  correction = 1.0 - correction * 0.020833334; // 1/48
  precise float from_middle = deviation * z;
  from_middle = from_middle * correction;
  from_middle = from_middle + ((n & uint64_t(1)) == uint64_t(1) ? 1.0 : 0.5);
  return uint64_t(int64_t(n >> 1) + int64_t(floor(from_middle)));
}

// The flakes of a node's four children, in the order (0,0), (1,0), (0,1), (1,1) of (x, y). First along x, then along y.
u64vec4 children_of(uint64_t n, uvec2 key) {
  uint64_t low_x = half_of(n, draw(key, 0u), draw(key, 1u));
  uint64_t high_x = n - low_x;
  uint64_t low_x_low_y = half_of(low_x, draw(key, 2u), draw(key, 3u));
  uint64_t high_x_low_y = half_of(high_x, draw(key, 4u), draw(key, 5u));
  return u64vec4(low_x_low_y, high_x_low_y, low_x - low_x_low_y, high_x - high_x_low_y);
}

// A flake's place inside its leaf, in units of 2^-32 of the leaf's side; it lies in the middle of that unit.
uvec2 flake_place(uvec2 leaf, uint flake) {
  uint at = FIRST_FLAKE_DRAW + 4u * flake;
  return uvec2(draw(leaf, at), draw(leaf, at + 1u));
}

// A flake's normal about +Z, not normalised: its slopes and 1. The slopes' variance is alpha^2 / 2 an axis; a flake
// drawn so has the weight 1 / (m.n), the length of this vector. `slope_deviation` is alpha / sqrt(2) rounded to f32.
vec3 flake_normal(uvec2 leaf, uint flake, float slope_deviation) {
  uint at = FIRST_FLAKE_DRAW + 4u * flake + 2u;
  vec2 pair = normal_pair(draw(leaf, at), draw(leaf, at + 1u));
  precise vec2 slopes = slope_deviation * pair;
  return vec3(slopes, 1.0);
}

#endif
