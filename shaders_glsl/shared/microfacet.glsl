// Microfacet distributions, shadowing and reflectance.
//
// D is normalised by the integral of D(h) (h.n) over the hemisphere = 1; slopes of Beckmann have variance alpha^2/2 an axis.
#ifndef MICROFACET_GLSL
#define MICROFACET_GLSL
#include "shared/constants.glsl"
#ifdef NAIVE_FORMS
#include "shared/naive_forms.glsl"
#endif

// The unit vector halfway between two, or 0 where they are opposite and there is none.
vec3 half_vector(vec3 i, vec3 o) {
  vec3 sum = i + o;
  float length2 = dot(sum, sum);
  return length2 > 1e-12 ? sum * inversesqrt(length2) : vec3(0.0);
}

// 1 - (h.n)^2 of unit vectors from their chord, whose digits last to the pole: relative error below 1e-6 there, where that of
// 1 - cos^2 is 1 at an angle of 3e-4 and that of |h x n|^2 is 2e-4 at 1e-3.
float sin_squared(vec3 h, vec3 n) {
#ifdef NAIVE_FORMS
  return naive_sin_squared(h, n);
#else
  vec3 chord = h - n;
  float chord2 = dot(chord, chord);
  return chord2 * (1.0 - 0.25 * chord2);
#endif
}

// Relative error below 2e-6 (1 + tan^2 / alpha^2): that of the exponent, times how steep D is. 0 from where exp() is.
float beckmann_d(vec3 h, vec3 n, float alpha) {
  float cosine = dot(h, n);
  if (cosine <= 0.0) {
    return 0.0;
  }
  float cos2 = cosine * cosine;
  float tan2 = sin_squared(h, n) / cos2;
  float alpha2 = alpha * alpha;
  return exp(-tan2 / alpha2) / (PI * alpha2 * cos2 * cos2);
}

float ggx_d(vec3 h, vec3 n, float alpha) {
  float cosine = dot(h, n);
  if (cosine <= 0.0) {
    return 0.0;
  }
  float alpha2 = alpha * alpha;
  float denominator = cosine * cosine * alpha2 + sin_squared(h, n);
  return alpha2 / (PI * denominator * denominator);
}

// G1(v) / (v.n) of Beckmann by the rational fit of Walter et al. 2007 (Eq. 27), the cosine cancelled by hand, so that it
// stays finite at the horizon: 3.535 / alpha there. Relative error of the fit at most 3.2e-3.
float beckmann_g1_over_cosine(float cosine, float alpha) {
  if (cosine <= 0.0) {
    return 0.0;
  }
#ifdef NAIVE_FORMS
  return naive_beckmann_g1_over_cosine(cosine, alpha);
#else
  float sine = sqrt(max(1.0 - cosine * cosine, 0.0));
  float a_denominator = alpha * sine;
  if (cosine >= 1.6 * a_denominator) {
    return 1.0 / cosine;
  }
  float k = 1.0 / a_denominator;
  float a = k * cosine;
  return min(k * (3.535 + 2.181 * a) / (1.0 + a * (2.276 + 2.577 * a)), 1.0 / cosine);
#endif
}

float ggx_g1_over_cosine(float cosine, float alpha) {
  if (cosine <= 0.0) {
    return 0.0;
  }
  float alpha2 = alpha * alpha;
  return 2.0 / (cosine + sqrt(alpha2 + (1.0 - alpha2) * cosine * cosine));
}

vec3 schlick(vec3 f0, float cosine) {
  float away = clamp(1.0 - cosine, 0.0, 1.0);
  float away2 = away * away;
  return f0 + (1.0 - f0) * (away2 * away2 * away);
}

// i.h of unit vectors, without cancellation when they point apart: relative error below 1e-6 up to half-angles of pi/2 - 1e-4.
float half_vector_cosine(vec3 i, vec3 o) {
#ifdef NAIVE_FORMS
  return naive_half_vector_cosine(i, o);
#else
  return 0.5 * length(i + o);
#endif
}

// A normal of the Beckmann distribution, by density D(h) (h.n), about +Z.
vec3 sample_beckmann(vec2 u, float alpha) {
  float tan2 = -alpha * alpha * log(max(1.0 - u.x, 1e-7));
  float cosine = inversesqrt(1.0 + tan2);
  float sine = sqrt(tan2) * cosine;
  return vec3(sine * cos(2.0 * PI * u.y), sine * sin(2.0 * PI * u.y), cosine);
}

// A normal of GGX, by density D(h) (h.n), about +Z.
vec3 sample_ggx(vec2 u, float alpha) {
  float tan2 = alpha * alpha * u.x / max(1.0 - u.x, 1e-7);
  float cosine = inversesqrt(1.0 + tan2);
  float sine = sqrt(tan2) * cosine;
  return vec3(sine * cos(2.0 * PI * u.y), sine * sin(2.0 * PI * u.y), cosine);
}

#endif
