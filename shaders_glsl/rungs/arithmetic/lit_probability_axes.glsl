// P(i, o, gamma) of a narrow cone: the density of slopes at h times the area of the conic's ellipse, assembled from the axes
// i x o and i - o; a.w is sin^2(gamma/2), b.w alpha.

float value(vec4 a, vec4 b, vec4 c) {
  vec3 i = a.xyz;
  vec3 o = b.xyz;
  float sin2_half_gamma = a.w;
  vec3 across = normalize(cross(i, o));
  vec3 along = normalize(i - o);
  vec3 h = normalize(i + o);
  float k = dot(i, o) + 1.0 - 2.0 * sin2_half_gamma;
  mat3 conic = k * outerProduct(across, across)
    + (2.0 - 2.0 * sin2_half_gamma) * outerProduct(along, along) - 2.0 * sin2_half_gamma * outerProduct(h, h);
  float determinant = conic[0].x * conic[1].y - conic[0].y * conic[1].x;
  float depth = 2.0 * sin2_half_gamma * (2.0 - 2.0 * sin2_half_gamma) * k / determinant;
  vec2 slope = h.xy / h.z;
  return exp(-dot(slope, slope) / (b.w * b.w)) * depth / (b.w * b.w * sqrt(determinant));
}
