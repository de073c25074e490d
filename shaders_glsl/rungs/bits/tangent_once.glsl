// A column of the frame of the unit normal a and the tangent b, the normal's share taken off once: the a.w-th, 0 to 2.

uvec4 answer(uvec4 a, uvec4 b) {
  vec3 normal = uintBitsToFloat(a.xyz);
  vec3 tangent = uintBitsToFloat(b.xyz);
  tangent = normalize(tangent - normal * dot(normal, tangent));
  return uvec4(floatBitsToUint(a.w == 0u ? tangent : a.w == 1u ? cross(normal, tangent) : normal), 0u);
}
