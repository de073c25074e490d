// Whether the flake c, of any length, is lit, by the same formula in f32: a.w is sin^2(gamma/2).

float value(vec4 a, vec4 b, vec4 c) {
  float i_m = dot(a.xyz, c.xyz);
  float square = dot(c.xyz, c.xyz);
  vec3 chord = 2.0 * i_m * c.xyz - square * (a.xyz + b.xyz);
  return i_m > 0.0 && dot(chord, chord) <= 4.0 * a.w * (square * square) ? 1.0 : 0.0;
}
