// Whether the flake c is lit: the conic of Jakob et al. 2014 in its own axes i x o, i - o and i + o.

float value(vec4 a, vec4 b, vec4 c) {
  vec3 i = a.xyz;
  vec3 o = b.xyz;
  vec3 m = c.xyz;
  float sin2_half_gamma = a.w;
  float across = dot(m, normalize(cross(i, o)));
  float along = dot(m, normalize(i - o));
  float h = dot(m, normalize(i + o));
  float form = (dot(i, o) + 1.0 - 2.0 * sin2_half_gamma) * across * across + (2.0 - 2.0 * sin2_half_gamma) * along * along;
  return form <= 2.0 * sin2_half_gamma * h * h && h > 0.0 ? 1.0 : 0.0;
}
