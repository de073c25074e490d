// What a device makes of what is no number: a.x is NaN, a.y infinite, a.z is 1, a.w is 0.

uvec4 answer(uvec4 a, uvec4 b) {
  vec4 x = uintBitsToFloat(a);
  float result = 0.0;
  switch (b.x) {
    case 0u: result = min(x.x, x.z); break;
    case 1u: result = min(x.z, x.x); break;
    case 2u: result = max(x.x, x.z); break;
    case 3u: result = max(x.z, x.x); break;
    case 4u: result = clamp(x.x, x.w, x.z); break;
    case 5u: result = isnan(x.x) ? 1.0 : 0.0; break;
    case 6u: result = x.y - x.y; break;
    case 7u: result = x.w * x.y; break;
    case 8u: result = x.x == x.x ? 1.0 : 0.0; break;
    case 9u: result = x.z / x.w; break;
    case 10u: result = sqrt(-x.z); break;
    case 11u: result = atan(x.w, x.w); break;
    case 12u: result = pow(x.w, x.w); break;
    case 13u: result = normalize(vec3(x.w)).x; break;
    case 14u: result = fract(uintBitsToFloat(b.y)); break;
    case 15u: result = isinf(x.y) ? 1.0 : 0.0; break;
    default: result = inversesqrt(x.w); break;
  }
  return uvec4(floatBitsToUint(result), 0u, 0u, 0u);
}
