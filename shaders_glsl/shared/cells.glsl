// Cells of unit side, and where in its cell a place lies: for coordinates of any size and sign.
//
// Indices are rounded down, as towards zero the cell about 0 would be twice as wide; and are signed, as what a negative
// float is as an unsigned integer is each device's own choice.
#ifndef CELLS_GLSL
#define CELLS_GLSL

const float LARGEST_CELL = 1073741824.0; // Cells are told apart to this index, 2^30: floats beyond it are clamped.

ivec2 cell_of(vec2 place) {
  return ivec2(clamp(floor(place), -LARGEST_CELL, LARGEST_CELL));
}

ivec3 cell_of(vec3 place) {
  return ivec3(clamp(floor(place), -LARGEST_CELL, LARGEST_CELL));
}

// 0 <= x < 1, rounded once: a place just below a whole number would otherwise round to 1, which is in the next cell.
vec2 within_cell(vec2 place) {
  return min(place - floor(place), 0.99999994);
}

#endif
