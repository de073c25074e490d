// The ellipse that a pixel's unit circle becomes in texture space.
#ifndef FOOTPRINT_ELLIPSE_GLSL
#define FOOTPRINT_ELLIPSE_GLSL

const float MAX_ANISOTROPY = 16384.0; // A narrower ellipse is widened to this ratio of its axes.
const float MAX_FOOTPRINT = 1e12; // A larger one, and one that is no number, is a circle of this radius.
const float MIN_FOOTPRINT = 1e-20; // The least radius, for a footprint without extent.

struct Ellipse {
  float major; // Half the longer axis.
  float minor; // Half the shorter axis.
  vec2 direction; // Unit, along the longer axis; either of its two signs.
};

// The singular values of the matrix with these columns, and the left singular vector of the greater. The sides are
// scaled first, so that no square leaves the range of floats.
Ellipse footprint_ellipse(vec2 dx, vec2 dy) {
  float scale = max(max(abs(dx.x), abs(dx.y)), max(abs(dy.x), abs(dy.y)));
  if (!(scale < MAX_FOOTPRINT)) {
    return Ellipse(MAX_FOOTPRINT, MAX_FOOTPRINT, vec2(1.0, 0.0));
  }
  scale = max(scale, MIN_FOOTPRINT);
  vec2 x = dx / scale;
  vec2 y = dy / scale;
  float major = 0.5 * (length(vec2(x.x + y.y, x.y - y.x)) + length(vec2(x.x - y.y, x.y + y.x)));
  major = max(major, 1e-3);
  // The quotient keeps digits that the difference of the two lengths loses.
  float minor = max(abs(x.x * y.y - x.y * y.x) / major, major / MAX_ANISOTROPY);
  // Twice the direction's angle is that of (difference, 2 mixed); halved without cancellation.
  float difference = x.x * x.x + y.x * y.x - x.y * x.y - y.y * y.y;
  float mixed_part = 2.0 * (x.x * x.y + y.x * y.y);
  float both = length(vec2(difference, mixed_part));
  vec2 direction = difference >= 0.0 ? vec2(both + difference, mixed_part) : vec2(mixed_part, both - difference);
  float size = length(direction);
  return Ellipse(scale * major, scale * min(minor, major), size > 1e-12 ? direction / size : vec2(1.0, 0.0));
}

// A whole number of any size as two words, for hashing: floats above 2^24 are whole, and beyond 2^52 the last is taken.
uvec2 words_of(float whole) {
  float high = floor(whole * (1.0 / 4194304.0));
  float low = whole - high * 4194304.0;
  return uvec2(uint(int(clamp(high, -1073741824.0, 1073741824.0))), uint(int(clamp(low, 0.0, 4194304.0))));
}

#endif
