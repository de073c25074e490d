// i.h by the half vector.

float value(vec4 a, vec4 b, vec4 c) {
  return dot(a.xyz, normalize(a.xyz + b.xyz));
}
