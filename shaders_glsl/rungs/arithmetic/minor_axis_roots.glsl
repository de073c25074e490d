// Half the shorter axis of the ellipse with the sides a.xy and a.zw, by the roots of the quadratic.

float value(vec4 a, vec4 b, vec4 c) {
  float trace = dot(a, a);
  float determinant = a.x * a.w - a.y * a.z;
  return sqrt(max(0.5 * (trace - sqrt(max(trace * trace - 4.0 * determinant * determinant, 0.0))), 0.0));
}
