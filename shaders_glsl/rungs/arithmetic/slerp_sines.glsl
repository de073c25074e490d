// The point at the fraction a.w of the arc from a to b, along c, as it is printed.

float value(vec4 a, vec4 b, vec4 c) {
  float angle = acos(dot(a.xyz, b.xyz));
  vec3 between = (sin((1.0 - a.w) * angle) * a.xyz + sin(a.w * angle) * b.xyz) / sin(angle);
  return dot(between, c.xyz);
}
