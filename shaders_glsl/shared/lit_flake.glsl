// Whether a flake is lit, in f64: where flakes are told apart one by one, an edge that is 1e-4 of the cone off shows.
#ifndef LIT_FLAKE_GLSL
#define LIT_FLAKE_GLSL

// Whether a flake of this normal, of any length, reflects i into the cone about o: |2 (i.m) m - i - o|^2 is at most
// 4 sin^2(gamma/2) for the unit normal m, and i.m > 0. Multiplied out, so that nothing is normalised. For lengths from 1e-30
// to 1e30 and gamma from .01 degrees on it is right but within 1e-11 of gamma about the cone's edge. Needs shaderFloat64.
bool flake_is_lit(vec3 normal, vec3 i, vec3 o, double sin2_half_gamma) {
  dvec3 m = dvec3(normal);
  double i_m = dot(dvec3(i), m);
  double square = dot(m, m);
  dvec3 chord = 2.0lf * i_m * m - square * (dvec3(i) + dvec3(o));
  return i_m > 0.0lf && dot(chord, chord) <= 4.0lf * sin2_half_gamma * (square * square);
}

#endif
