// A place of whole coordinates hashed by primes and exclusive or (Teschner et al. 2003).

uvec4 answer(uvec4 a, uvec4 b) {
  uint bits = (a.x * 73856093u) ^ (a.y * 19349663u) ^ (a.z * 83492791u);
  return uvec4(bits, bits, 0u, 0u);
}
