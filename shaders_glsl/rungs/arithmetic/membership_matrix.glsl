// Whether the flake c is lit: the matrix C of Jakob et al. 2014, assembled from i, o and cos(gamma).

float value(vec4 a, vec4 b, vec4 c) {
  vec3 i = a.xyz;
  vec3 o = b.xyz;
  vec3 m = c.xyz;
  float cos_gamma = b.w;
  float k = dot(i, o) + cos_gamma;
  mat3 matrix = (k * mat3(1.0) - outerProduct(i, o) - outerProduct(o, i)) / (1.0 - cos_gamma);
  return dot(m, matrix * m) <= 0.0 && dot(i, m) > 0.0 ? 1.0 : 0.0;
}
