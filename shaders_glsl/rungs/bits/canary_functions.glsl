// Sine and cosine of a.x, exponential of a.y, logarithm of a.z.

uvec4 answer(uvec4 a, uvec4 b) {
  vec4 x = uintBitsToFloat(a);
  return floatBitsToUint(vec4(sin(x.x), cos(x.x), exp(x.y), log(x.z)));
}
