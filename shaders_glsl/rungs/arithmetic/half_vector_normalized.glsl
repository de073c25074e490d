// The half vector of a and b, along c, as normalize() has it.

float value(vec4 a, vec4 b, vec4 c) {
  return dot(normalize(a.xyz + b.xyz), c.xyz);
}
