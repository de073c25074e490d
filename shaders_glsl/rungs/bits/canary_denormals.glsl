// Denormals: read and written, halved from the least normal float, added to 0, and multiplied back to a normal one.

uvec4 answer(uvec4 a, uvec4 b) {
  float least_normal = uintBitsToFloat(a.x);
  float denormal = uintBitsToFloat(a.y);
  float zero = uintBitsToFloat(a.z);
  float scale = uintBitsToFloat(a.w);
  float half_of_least = least_normal * 0.5;
  float sum = denormal + zero;
  float product = denormal * scale;
  return uvec4(floatBitsToUint(denormal), floatBitsToUint(half_of_least), floatBitsToUint(sum), floatBitsToUint(product));
}
