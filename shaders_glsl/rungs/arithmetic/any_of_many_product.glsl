// The chance that any of 64 lights is seen, each by one of the twelve chances in turn, as 1 minus a product.

float value(vec4 a, vec4 b, vec4 c) {
  float chances[12] = float[](a.x, a.y, a.z, a.w, b.x, b.y, b.z, b.w, c.x, c.y, c.z, c.w);
  float none = 1.0;
  for (int light = 0; light < 64; ++light) {
    none *= 1.0 - chances[light % 12];
  }
  return 1.0 - none;
}
