// The normals that reflect i into the cone of half-angle gamma about o (Jakob et al. 2014, section 4), from unit vectors and
// sin^2(gamma/2) of the host's f64: 1 - cos(gamma) of a cosine in f32 is wrong by 2 % at .1 degrees, and 0 at .01.
#ifndef REFLECTING_SET_GLSL
#define REFLECTING_SET_GLSL

// Whether the unit normal m is one: the chord from o to where m mirrors i is at most that of gamma, and m faces i. No axes,
// hence nothing to lose where i = o. Right but within 2e-7 radians of the cone's edge.
bool reflects_into_cone(vec3 m, vec3 i, vec3 o, float sin2_half_gamma) {
  float i_m = dot(i, m);
  vec3 chord = 2.0 * i_m * m - i - o;
  return dot(chord, chord) <= 4.0 * sin2_half_gamma && i_m > 0.0;
}

// i.o + cos(gamma), from i + o: that of the three eigenvalues of the undivided conic which belongs to i x o, the others being
// -2 sin^2(gamma/2) of i + o and 1 + cos(gamma) of i - o. Over 2 sin^2(gamma/2) it is the paper's lambda_1; error below
// 4e-7 of its terms. Not positive where the set reaches the horizon of i and o.
float conic_across(vec3 sum, float sin2_half_gamma) {
  return 0.5 * dot(sum, sum) - 2.0 * sin2_half_gamma;
}

#endif
