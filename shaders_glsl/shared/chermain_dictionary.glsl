// How the dictionary of Chermain, Sauvage, Dischler and Dachsbacher 2020 is laid out: even distributions of one slope,
// for half their support, each at several levels of detail.
#ifndef CHERMAIN_DICTIONARY_GLSL
#define CHERMAIN_DICTIONARY_GLSL

const uint CHERMAIN_MARGINALS = 192u; // Distributions of each level.
const uint CHERMAIN_LEVELS = 16u; // Level l is made of 2^l pairs of lobes.
const uint CHERMAIN_TEXELS = 64u; // Samples of a distribution, from slope 0 to the end of its support.
const float CHERMAIN_ALPHA = 0.5; // Roughness that the dictionary is made for.
const float CHERMAIN_SUPPORT = 1.41421356237309505; // Slope at which its distributions end: four standard deviations.

layout(std430, binding = 52) readonly buffer Dictionary { float dictionary[]; };

// Density of one slope by a distribution of the dictionary, linear between texel centres.
float marginal_density(uint level, uint index, float slope) {
  float magnitude = abs(slope);
  if (magnitude >= CHERMAIN_SUPPORT) {
    return 0.0;
  }
  float at = magnitude * (float(CHERMAIN_TEXELS) / CHERMAIN_SUPPORT) - 0.5;
  int below = int(floor(at));
  uint row = (level * CHERMAIN_MARGINALS + index) * CHERMAIN_TEXELS;
  float low = dictionary[row + uint(max(below, 0))];
  float high = dictionary[row + uint(min(below + 1, int(CHERMAIN_TEXELS) - 1))];
  return mix(low, high, at - float(below));
}

#endif
