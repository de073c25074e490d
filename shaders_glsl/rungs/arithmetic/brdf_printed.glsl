// D G / (4 (i.n) (o.n)) of Beckmann as it is printed, cosines kept from 0 by 1e-4; i and o about +Z, a.w is alpha.
#include "shared/constants.glsl"

float g1(float cosine, float alpha) {
  float inverse = 1.0 / (alpha * tan(acos(cosine)));
  return inverse < 1.6
    ? (3.535 * inverse + 2.181 * inverse * inverse) / (1.0 + 2.276 * inverse + 2.577 * inverse * inverse)
    : 1.0;
}

float value(vec4 a, vec4 b, vec4 c) {
  float cosine = normalize(a.xyz + b.xyz).z;
  float cos2 = cosine * cosine;
  float alpha2 = a.w * a.w;
  float d = exp(-(1.0 - cos2) / cos2 / alpha2) / (PI * alpha2 * cos2 * cos2);
  return d * g1(a.z, a.w) * g1(b.z, a.w) / (4.0 * max(a.z, 1e-4) * max(b.z, 1e-4));
}
