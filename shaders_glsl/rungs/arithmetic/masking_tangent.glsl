// G1 / cos of Beckmann with the tangent as it is printed; a.x is the cosine, a.y alpha.

float value(vec4 a, vec4 b, vec4 c) {
  float cosine = a.x;
  float inverse = 1.0 / (a.y * tan(acos(cosine)));
  float g1 = inverse < 1.6
    ? (3.535 * inverse + 2.181 * inverse * inverse) / (1.0 + 2.276 * inverse + 2.577 * inverse * inverse)
    : 1.0;
  return g1 / cosine;
}
