// Where in texture space a point of a triangle lies.
#ifndef TEXTURE_PLACE_GLSL
#define TEXTURE_PLACE_GLSL

// The place at `weights` of the second and third corner. Where flakes repeat with each square of texture, whole squares are
// taken off the corners first, without rounding but for corners just below 0: 1e6 squares from the origin a float tells 16
// places in a square apart, and interpolation would round to them.
vec2 texture_place(vec2 corner1, vec2 corner2, vec2 corner3, vec2 weights, bool repeats) {
  vec2 squares = repeats ? floor(min(min(corner1, corner2), corner3)) : vec2(0.0);
  precise vec2 near1 = corner1 - squares;
  vec2 edge2 = corner2 - corner1;
  vec2 edge3 = corner3 - corner1;
  return near1 + weights.x * edge2 + weights.y * edge3;
}

#endif
