// P(i, o, gamma) over the ellipse of slopes, its quadratic form assembled with i.o + cos gamma and evaluated from the
// origin (Jakob et al. 2014, Eq. 13), as a box of its area: a is i and alpha, b is o and sin^2(gamma/2).
#include "shared/constants.glsl"
#include "shared/error_function.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  vec3 i = a.xyz;
  vec3 o = b.xyz;
  float gamma = 2.0 * asin(sqrt(b.w));
  float k = dot(i, o) + cos(gamma);
  float xx = k - 2.0 * i.x * o.x;
  float yy = k - 2.0 * i.y * o.y;
  float zz = k - 2.0 * i.z * o.z;
  float xy = -(i.x * o.y + i.y * o.x);
  vec2 linear = -vec2(i.x * o.z + i.z * o.x, i.y * o.z + i.z * o.y);
  float determinant = xx * yy - xy * xy;
  vec2 center = -vec2(yy * linear.x - xy * linear.y, xx * linear.y - xy * linear.x) / determinant;
  float scale = -(zz + dot(linear, center));
  float difference = length(vec2(xx - yy, 2.0 * xy));
  float large = 0.5 * (xx + yy + difference);
  float small = 0.5 * (xx + yy - difference);
  vec2 along = normalize(vec2(xy, small - xx) + vec2(1e-12, 0.0));
  vec2 middle = vec2(dot(center, along), along.x * center.y - along.y * center.x);
  vec2 reach = 0.5 * sqrt(PI) * sqrt(scale / vec2(small, large));
  return 0.25 * erf_about(middle.x / a.w, reach.x / a.w) * erf_about(middle.y / a.w, reach.y / a.w);
}
