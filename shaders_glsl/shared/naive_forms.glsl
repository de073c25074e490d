// Formulas as they are printed, where others in shared/ keep more digits: what stable forms are measured against. No method
// includes this; NAIVE_FORMS, which measurements define, puts them in the place of the stable ones.
#ifndef NAIVE_FORMS_GLSL
#define NAIVE_FORMS_GLSL

// 1 - (h.n)^2.
float naive_sin_squared(vec3 h, vec3 n) {
  float cosine = dot(h, n);
  return 1.0 - cosine * cosine;
}

// i.h by the half vector.
float naive_half_vector_cosine(vec3 i, vec3 o) {
  return dot(i, normalize(i + o));
}

// G1 / cos of Beckmann by Walter et al. 2007 (Eq. 27), with the tangent as it is printed.
float naive_beckmann_g1_over_cosine(float cosine, float alpha) {
  float inverse = 1.0 / (alpha * tan(acos(cosine)));
  float g1 = inverse < 1.6
    ? (3.535 * inverse + 2.181 * inverse * inverse) / (1.0 + 2.276 * inverse + 2.577 * inverse * inverse)
    : 1.0;
  return g1 / cosine;
}

// The chance 1 - (1 - p)^n of any success.
float naive_chance_of_any(float n, float p) {
  return 1.0 - pow(1.0 - p, n);
}

// a d - b c.
float naive_determinant(float a, float b, float c, float d) {
  return a * d - b * c;
}

// The slope beyond which nothing counts, from the normal alone.
float naive_slope_reach(float alpha) {
  return 5.0 * alpha;
}

#endif
