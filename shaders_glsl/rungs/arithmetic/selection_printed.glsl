// P-hat of Wang, Deng and Holzschuch 2020, Eq. 17, by its 36 x 9 directions; a is o.n, alpha and sin^2(gamma/2).
#include "shared/lit_probability.glsl"

float value(vec4 a, vec4 b, vec4 c) {
  vec3 o = vec3(sqrt(max((1.0 - a.x) * (1.0 + a.x), 0.0)), 0.0, a.x);
  float sum = 0.0;
  for (int j = 0; j < 324; ++j) {
    float cosine = (float(j / 36) + 0.5) / 9.0;
    float phi = float(j % 36) / 36.0 * 2.0 * PI;
    float sine = sqrt(1.0 - cosine * cosine);
    sum += lit_probability(vec3(sine * cos(phi), sine * sin(phi), cosine), o, a.z, a.y);
  }
  return 2.0 * PI / 324.0 * sum;
}
