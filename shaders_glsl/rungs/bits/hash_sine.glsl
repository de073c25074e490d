// A place of whole coordinates hashed by the fraction of a large sine, as is widespread in shaders: 24 bits.

uvec4 answer(uvec4 a, uvec4 b) {
  float place = dot(vec2(ivec2(a.xy)), vec2(12.9898, 78.233));
  uint bits = uint(fract(sin(place) * 43758.5453) * 16777216.0);
  return uvec4(bits << 8, bits << 8, 0u, 0u);
}
