// How much of a square of texture a footprint covers.
#ifndef FOOTPRINT_GLSL
#define FOOTPRINT_GLSL

// The integral of min(max(y, 0), 1) from 0 to y.
float clamped_integral(float y) {
  return y <= 0.0 ? 0.0 : (y < 1.0 ? 0.5 * y * y : y - 0.5);
}

// Signed area, inside the unit square, below the edge from p to q.
float area_below(vec2 p, vec2 q) {
  vec2 left = p.x < q.x ? p : q;
  vec2 right = p.x < q.x ? q : p;
  float width = right.x - left.x;
  if (width < 1e-9 || right.x <= 0.0 || left.x >= 1.0) {
    return 0.0;
  }
  float slope = (right.y - left.y) / width;
  float from = max(left.x, 0.0);
  float to = min(right.x, 1.0);
  float y0 = left.y + (from - left.x) * slope;
  float y1 = left.y + (to - left.x) * slope;
  float area = abs(y1 - y0) < 1e-3
    ? clamp(0.5 * (y0 + y1), 0.0, 1.0) * (to - from)
    : (to - from) * (clamped_integral(y1) - clamped_integral(y0)) / (y1 - y0);
  return p.x < q.x ? area : -area;
}

// Share of a box that lies in the parallelogram.
float share_inside(vec4 box, vec2 corner, vec2 side_x, vec2 side_y) {
  vec2 size = box.zw - box.xy;
  vec2 a = (corner - box.xy) / size;
  vec2 x = side_x / size;
  vec2 y = side_y / size;
  float area = area_below(a, a + x) + area_below(a + x, a + x + y) + area_below(a + x + y, a + y) + area_below(a + y, a);
  return min(abs(area), 1.0);
}

#endif
