// Whether the flake c is lit: the chord from o to where it mirrors i, against 4 sin^2(gamma/2).

float value(vec4 a, vec4 b, vec4 c) {
  vec3 i = a.xyz;
  vec3 o = b.xyz;
  vec3 m = c.xyz;
  float sin2_half_gamma = a.w;
  float i_m = dot(i, m);
  vec3 chord = 2.0 * i_m * m - i - o;
  return dot(chord, chord) <= 4.0 * sin2_half_gamma && i_m > 0.0 ? 1.0 : 0.0;
}
