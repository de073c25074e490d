// What flakes show of a footprint over what a smooth surface would: how many it holds, c.x being what is left to chance of the
// next one, over how many it should. Sides a.xy and a.zw, b.x flakes in a square of texture.

float value(vec4 a, vec4 b, vec4 c) {
  float expected = abs(a.x * a.w - a.y * a.z) * b.x;
  return floor(expected + c.x) / expected;
}
