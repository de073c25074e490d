// A column of the frame about the unit normal a, by Frisvad 2012 without the exception at -Z: the b.x-th, 0 to 2.

uvec4 answer(uvec4 a, uvec4 b) {
  vec3 n = uintBitsToFloat(a.xyz);
  float over = 1.0 / (1.0 + n.z);
  float both = -n.x * n.y * over;
  vec3 tangent = vec3(1.0 - n.x * n.x * over, both, -n.x);
  vec3 bitangent = vec3(both, 1.0 - n.y * n.y * over, -n.y);
  return uvec4(floatBitsToUint(b.x == 0u ? tangent : b.x == 1u ? bitangent : n), 0u);
}
