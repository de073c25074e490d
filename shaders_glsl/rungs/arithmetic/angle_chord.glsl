// The angle between two directions, from the chord.

float value(vec4 a, vec4 b, vec4 c) {
  return 2.0 * asin(0.5 * length(a.xyz - b.xyz));
}
