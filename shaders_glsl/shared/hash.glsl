// Integer hashes: the only source of randomness. Nothing here depends on the precision of a float.
#ifndef HASH_GLSL
#define HASH_GLSL

// One full mixer of a word (Wellons's lowbias32).
uint mixed(uint x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  return x;
}

// A chain of mixers, one a word: the order of the words matters.
uint hash(uint a, uint b) {
  return mixed(a + mixed(b));
}

uint hash(uint a, uint b, uint c) {
  return mixed(a + hash(b, c));
}

// Uniform inside (0, 1), all 24 bits used. The greatest sum of a number and a half rounds up, to 1 but for the minimum.
float unit_from(uint bits) {
  return min((float(bits >> 8) + 0.5) * (1.0 / 16777216.0), 0.99999994);
}

// Uniform inside (0, 1), small numbers with 24 bits of their own: for chances below 1e-5, which the number above meets
// only to 6e-8. Within 2^-33 of (bits + 1/2) / 2^32, and of relative precision 2^-24.
float rare_unit_from(uint bits) {
  return min((float(bits) + 0.5) * (1.0 / 4294967296.0), 0.99999994);
}

// Two words from two by the Tiny Encryption Algorithm of 8 rounds (Wheeler and Needham 1994), which Jakob et al. 2014
// seed their splits with.
uvec2 tea(uvec2 value) {
  uint sum = 0u;
  for (int step = 0; step < 8; ++step) {
    sum += 0x9e3779b9u;
    value.x += ((value.y << 4) + 0xa341316cu) ^ (value.y + sum) ^ ((value.y >> 5) + 0xc8013ea4u);
    value.y += ((value.x << 4) + 0xad90777du) ^ (value.x + sum) ^ ((value.x >> 5) + 0x7e95761eu);
  }
  return value;
}

#endif
