// The angle between two directions, from their cosine.

float value(vec4 a, vec4 b, vec4 c) {
  return acos(dot(a.xyz, b.xyz));
}
