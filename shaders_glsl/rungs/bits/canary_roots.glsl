// Arc tangent of a.x, square root of a.y and its inverse, a.z / a.w.

uvec4 answer(uvec4 a, uvec4 b) {
  vec4 x = uintBitsToFloat(a);
  return floatBitsToUint(vec4(atan(x.x), sqrt(x.y), inversesqrt(x.y), x.z / x.w));
}
