// Counts to a.x in a loop, then to a.y in another, and the sum of the first loop's numbers from a.z on.

uvec4 answer(uvec4 a, uvec4 b) {
  uint first = 0u;
  uint sum = 0u;
  // The sum depends on each round: there is no closed form for a compiler to find.
  for (uint k = 0u; k < a.x; ++k) {
    sum = (sum ^ (a.z + k)) * 0x9e3779b1u + (sum >> 15);
    ++first;
  }
  uint second = 0u;
  for (uint k = 0u; k < a.y; ++k) {
    sum = (sum ^ k) * 0x9e3779b1u + (sum >> 15);
    ++second;
  }
  return uvec4(first, second, sum, 0u);
}
