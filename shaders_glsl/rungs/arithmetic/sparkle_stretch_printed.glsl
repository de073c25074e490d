// Stretch of Wang and Bowles's sparkles along the view a seen from the normal b, as printed.

float value(vec4 a, vec4 b, vec4 c) {
  float facing = dot(a.xyz, b.xyz);
  vec3 tangent = a.xyz - facing * b.xyz;
  return (abs(facing) - 1.0) / dot(tangent, tangent);
}
