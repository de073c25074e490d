// lambda_1 of the conic of Jakob et al. 2014 as it is printed; b.w is cos(gamma).

float value(vec4 a, vec4 b, vec4 c) {
  return (dot(a.xyz, b.xyz) + b.w) / (1.0 - b.w);
}
