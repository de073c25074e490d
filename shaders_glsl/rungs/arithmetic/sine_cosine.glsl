// The sine of the angle between two directions, from their cosine.

float value(vec4 a, vec4 b, vec4 c) {
  float cosine = dot(a.xyz, b.xyz);
  return sqrt(1.0 - cosine * cosine);
}
