// Whether the flake c is lit: two scalar products against cos(gamma).

float value(vec4 a, vec4 b, vec4 c) {
  vec3 i = a.xyz;
  vec3 o = b.xyz;
  vec3 m = c.xyz;
  float cos_gamma = b.w;
  float i_m = dot(i, m);
  return 2.0 * i_m * dot(o, m) - dot(i, o) >= cos_gamma && i_m > 0.0 ? 1.0 : 0.0;
}
