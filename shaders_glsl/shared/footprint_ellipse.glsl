// The ellipse that a pixel's unit circle becomes in texture space.
#ifndef FOOTPRINT_ELLIPSE_GLSL
#define FOOTPRINT_ELLIPSE_GLSL
#include "shared/footprint_area.glsl"

const float MAX_ANISOTROPY = 16384.0; // A narrower ellipse is widened to this ratio of its axes.
const float MAX_FOOTPRINT = 1e12; // A larger one, and one that is no number, is a circle of this radius.
const float MIN_FOOTPRINT = 1e-20; // The least radius, for a footprint without extent.

struct Ellipse {
  float major; // Half the longer axis.
  float minor; // Half the shorter axis.
  vec2 direction; // Unit, along the longer axis; either of its two signs.
};

// Half the longer and half the shorter axis of the ellipse with these sides, of which the larger coordinate is 1e-3 to 2: the
// singular values of the matrix with these columns (Blinn 1996, "Consider the lowly 2 x 2 matrix"). Off by 16 units in the last
// place while they are as 1e6 to 1 at most: the quotient keeps digits that the difference of the two lengths loses.
vec2 scaled_axes(vec2 x, vec2 y) {
  float major = 0.5 * (length(vec2(x.x + y.y, x.y - y.x)) + length(vec2(x.x - y.y, x.y + y.x)));
  major = max(major, 1e-3);
  return vec2(major, abs(determinant_of(x.x, x.y, y.x, y.y)) / major);
}

// The same of any sides of 1e-30 to 1e30.
vec2 footprint_axes(vec2 dx, vec2 dy) {
  float size = max(size_of_side(dx), size_of_side(dy));
  return octave_of(size) * scaled_axes(dx * over_octave_of(size), dy * over_octave_of(size));
}

// The singular values of the matrix with these columns, and the left singular vector of the greater. The sides are
// scaled first, so that no square leaves the range of floats, and by a power of two, so that the shorter axis stays what it is.
Ellipse footprint_ellipse(vec2 dx, vec2 dy) {
  float largest = max(max(abs(dx.x), abs(dx.y)), max(abs(dy.x), abs(dy.y)));
  if (!(largest < MAX_FOOTPRINT)) {
    return Ellipse(MAX_FOOTPRINT, MAX_FOOTPRINT, vec2(1.0, 0.0));
  }
  largest = max(largest, MIN_FOOTPRINT);
  float scale = octave_of(largest);
  vec2 x = dx * over_octave_of(largest);
  vec2 y = dy * over_octave_of(largest);
  vec2 axes = scaled_axes(x, y);
  float major = axes.x;
  float minor = max(axes.y, major / MAX_ANISOTROPY);
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
