// Reads eight numbers, and computes nothing.

float value(vec4 a, vec4 b, vec4 c) {
  return a.x + a.y + a.z + a.w + b.x + b.y + b.z + b.w;
}
