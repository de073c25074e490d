// The grid of B. Wang and H. Bowles 2016 (code 2), without its divisions by 0.
#ifndef SPARKLE_GRID_GLSL
#define SPARKLE_GRID_GLSL

// The distance that stands for a level of the grid, 0.1 * 2^level - 0.2. Domain: levels to 127; below 2 as level 2, where the
// formula is 0 and the grid infinitely fine. Relative error at most 2e-7: 2^level is exact, and at level 2 the difference
// doubles what 0.1 and 0.2 are rounded by.
float sparkle_distance(int level) {
  return max(0.1 * ldexp(1.0, max(level, 2)) - 0.2, 0.2);
}

// The unit vector along which the view shifts the grid. Domain: unit views, any finite distance. Where all components of
// their product are whole to 1e-4, there is no direction left in their fractions: the view's own. Of length 1 within 4e-7.
vec3 sparkle_shift(vec3 view, float distance_of_level) {
  vec3 turned = fract(view * distance_of_level);
  float turned2 = dot(turned, turned);
  return turned2 < 1e-8 ? view : turned * inversesqrt(turned2);
}

// Factor of the part along the tangent t = v - c n by which a sparkle is stretched so that it looks round, c = v.n: as printed
// (|c| - 1) / t^2, which is 0/0 at normal incidence; with t^2 = 1 - c^2 it is -1 / (1 + |c|). Domain: |c| <= 1. Relative error
// at most 3e-7 for `least` = 0; where |c| < `least`, a sparkle is stretched as if it were that.
float sparkle_stretch(float facing, float least) {
  float c = abs(facing);
  return c >= least ? -1.0 / (1.0 + c) : (least - 1.0) / (1.0 - c * c);
}

#endif
