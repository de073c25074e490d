// The flakes of a parallelogram in texture space, leaf by leaf: which leaves it meets, how many flakes each has, and
// which of them lie inside (engine/design/0007-flake-set.md).
//
// A walk goes through the rows of leaves that the parallelogram meets and in each through the columns, whatever square of
// the texture they lie in: long thin footprints cost no more than their length. Leaves have their flakes from a table of
// the quadtree at one level (passes/flakes/flake_counts.comp), by way of their ancestors below it. A walk can be left
// between any two leaves and taken up again from `next`. Needs shaderInt64 and shaderFloat64.
//
// Inside means 0 <= to x e2 / (e1 x e2) < 1 and 0 <= e1 x to / (e1 x e2) < 1 for the flake's offset `to` from the corner,
// as if computed without rounding: sides are f32, so that their products with whole numbers of leaves are exact in f64,
// and sums carry their rounding errors along (Dekker 1971). What is rounded is 2^-52 of a leaf.
#ifndef FLAKES_IN_FOOTPRINT_GLSL
#define FLAKES_IN_FOOTPRINT_GLSL
#include "shared/flake_set.glsl"
#include "shared/footprint_area.glsl"
#include "shared/lit_flake.glsl"

layout(std430, binding = 55) readonly buffer FlakeCounts { uvec2 flake_counts[]; }; // Low and high word, row by row.

const uint FLAKE_TABLE_LEVEL = 9u; // Level of the table of counts, where leaves are not above it.
const uint FLAKE_LEVELS_BELOW = 10u; // Leaves lie at most so many levels below the table.
const int FLAKE_STEPS_A_PASS = 7000; // What an invocation does in a pass: one driver ends it silently not far beyond.

// What a walk needs of the set: all that depends on the number of flakes and the seed.
struct FlakeSet {
  uint leaf_level;
  uint table_level; // The lesser of `leaf_level` and `FLAKE_TABLE_LEVEL`.
  uint seed;
};

// A walk, in units of a leaf's side from the corner of the square of texture that the footprint's corner lies in. Pairs
// of doubles are a rounded number and its rounding error.
struct FlakeWalk {
  dvec2 corner;
  dvec2 across_x; // to x across_x is what is between 0 and `whole` inside; for one pair of sides
  dvec2 across_y; // and for the other.
  dvec2 corner_x; // The corner x across_x,
  dvec2 corner_y; // and x across_y.
  dvec2 whole; // Area, not negative.
  dvec2 low; // Of the bounding box, from the corner.
  dvec2 high;
  ivec2 next; // Column and row of the leaf that comes next.
  int last_column; // Of this row.
  int last_row;
  uvec2 leaf; // Name of the leaf that was met.
  uint flakes; // In it, in the footprint or not.
  ivec2 at; // Its column and row.
};

// Flakes of the ancestors of the leaf that was met last, from the table's level down.
uint flake_ancestors[FLAKE_LEVELS_BELOW + 1u];
ivec2 flake_ancestors_of; // Column and row of that leaf,
bool flake_ancestors_known = false; // if there was one.

// a + b and its rounding error (Knuth 1969).
dvec2 two_sum(double a, double b) {
  precise double sum = a + b;
  precise double b_part = sum - a;
  precise double rest = (a - (sum - b_part)) + (b - b_part);
  return dvec2(sum, rest);
}

// A pair and a number added up.
dvec2 pair_sum(dvec2 pair, double b) {
  dvec2 sum = two_sum(pair.x, b);
  precise double rest = pair.y + sum.y;
  return two_sum(sum.x, rest);
}

// The corner (`at` + `rest`) x `side`, for a side of f32 numbers.
dvec2 corner_cross(dvec2 at, dvec2 rest, dvec2 side) {
  // The upper 24 bits and the lower 29, of which products with 24 bits are exact.
  dvec2 upper = dvec2(vec2(at));
  precise dvec2 lower = at - upper;
  precise double x_upper = upper.x * side.y;
  precise double y_upper = upper.y * side.x;
  precise double x_lower = lower.x * side.y;
  precise double y_lower = lower.y * side.x;
  precise double of_rest = rest.x * side.y - rest.y * side.x;
  dvec2 sum = two_sum(x_upper, -y_upper);
  sum = pair_sum(sum, x_lower);
  sum = pair_sum(sum, -y_lower);
  return pair_sum(sum, of_rest);
}

// The corner of the footprint of a pixel whose centre sees `uv`.
dvec2 footprint_corner(vec2 uv, vec2 side_x, vec2 side_y) {
  precise dvec2 diagonal = dvec2(side_x) + dvec2(side_y);
  precise dvec2 corner = dvec2(uv) - 0.5lf * diagonal;
  return corner;
}

// Narrows `low` to `high` to the x, from the corner, for which 0 <= x across.y - y across.x <= whole for some y of a row.
void narrow(FlakeWalk walk, dvec2 across, dvec2 row, inout double low, inout double high) {
  if (across.y != 0.0lf) {
    double from_low = row.x * across.x;
    double from_high = row.y * across.x;
    double doubt = 1e-12lf * (walk.whole.x + abs(from_low) + abs(from_high));
    double least = min(from_low, from_high) - doubt;
    double most = max(from_low, from_high) + walk.whole.x + doubt;
    double over = 1.0lf / across.y;
    low = max(low, min(least * over, most * over));
    high = min(high, max(least * over, most * over));
  }
}

// The columns of a row that the footprint may meet: first and last; none where the last is less.
ivec2 flake_columns(FlakeWalk walk, int row) {
  const double SLACK = 1e-6lf; // Rounding, with much to spare.
  double y = double(row) - walk.corner.y;
  dvec2 ends = dvec2(y - SLACK, y + 1.0lf + SLACK);
  double low = walk.low.x;
  double high = walk.high.x;
  narrow(walk, walk.across_x, ends, low, high);
  narrow(walk, walk.across_y, ends, low, high);
  // Not beyond what an int holds; an empty row stays empty.
  double first = floor(clamp(walk.corner.x + low - SLACK, -1e9lf, 1e9lf));
  double last = floor(clamp(walk.corner.x + high + SLACK, -1e9lf, 1e9lf));
  return ivec2(int(first), low <= high ? int(last) : int(first) - 1);
}

// A walk through the flakes of corner + a side_x + b side_y, 0 <= a, b < 1.
FlakeWalk start_flake_walk(FlakeSet set, dvec2 corner, vec2 side_x, vec2 side_y) {
  double leaves = double(1u << set.leaf_level);
  dvec2 square = floor(corner);
  dvec2 x = two_sum(corner.x, -square.x);
  dvec2 y = two_sum(corner.y, -square.y);
  dvec2 e1 = leaves * dvec2(side_x);
  dvec2 e2 = leaves * dvec2(side_y);
  precise double right = e1.x * e2.y;
  precise double left = e1.y * e2.x;
  dvec2 whole = two_sum(right, -left);
  // Either way round, what is inside lies between 0 and the area.
  double turn = whole.x < 0.0lf ? -1.0lf : 1.0lf;
  FlakeWalk walk;
  walk.corner = leaves * dvec2(x.x, y.x);
  walk.across_x = turn * e2;
  walk.across_y = -turn * e1;
  dvec2 rest = leaves * dvec2(x.y, y.y);
  walk.corner_x = corner_cross(walk.corner, rest, walk.across_x);
  walk.corner_y = corner_cross(walk.corner, rest, walk.across_y);
  walk.whole = turn * whole;
  walk.low = min(dvec2(0.0lf), e1) + min(dvec2(0.0lf), e2);
  walk.high = max(dvec2(0.0lf), e1) + max(dvec2(0.0lf), e2);
  int first_row = int(floor(clamp(walk.corner.y + walk.low.y - 1e-6lf, -1e9lf, 1e9lf)));
  walk.last_row = int(floor(clamp(walk.corner.y + walk.high.y + 1e-6lf, -1e9lf, 1e9lf)));
  walk.last_row = walk.whole.x > 0.0lf ? walk.last_row : first_row - 1;
  ivec2 columns = flake_columns(walk, first_row);
  walk.next = ivec2(columns.x, first_row);
  walk.last_column = columns.y;
  walk.flakes = 0u;
  return walk;
}

// The same walk from where it was left.
void resume_flake_walk(inout FlakeWalk walk, ivec2 next) {
  walk.next = next;
  walk.last_column = flake_columns(walk, next.y).y;
}

bool flake_walk_is_over(FlakeWalk walk) {
  return walk.next.y > walk.last_row;
}

// Flakes of one child of a node of `n`.
uint flakes_of_child(uint n, uvec2 key, uvec2 child) {
  uint64_t all = uint64_t(n);
  uint64_t low_x = half_of(all, draw(key, 0u), draw(key, 1u));
  uint64_t column = child.x == 0u ? low_x : all - low_x;
  uint at = 2u + 2u * child.x;
  uint64_t low_y = half_of(column, draw(key, at), draw(key, at + 1u));
  return uint(child.y == 0u ? low_y : column - low_y);
}

// Goes on to the next leaf, which may have no flakes, or past the end of a row, where `flakes` is 0. Returns how many steps
// that took.
int next_flake_leaf(FlakeSet set, inout FlakeWalk walk) {
  int steps = 1;
  walk.flakes = 0u;
  if (walk.next.x > walk.last_column) {
    walk.next.y += 1;
    ivec2 columns = flake_columns(walk, walk.next.y);
    walk.next.x = columns.x;
    walk.last_column = columns.y;
    return steps;
  }
  walk.at = walk.next;
  walk.next.x += 1;
  uint mask = (1u << set.leaf_level) - 1u;
  uvec2 place = uvec2(walk.at) & mask;
  walk.leaf = node_key(set.leaf_level, place.x, place.y, set.seed);
  // From the deepest ancestor that the last leaf shares.
  uvec2 differing = place ^ (uvec2(flake_ancestors_of) & mask);
  uint shared_level = set.leaf_level - uint(findMSB(differing.x | differing.y) + 1);
  uint level = flake_ancestors_known ? max(shared_level, set.table_level) : set.table_level;
  if (level == set.table_level) {
    uvec2 node = place >> (set.leaf_level - level);
    flake_ancestors[0] = flake_counts[(node.y << level) + node.x].x;
  }
  flake_ancestors_of = walk.at;
  flake_ancestors_known = true;
  for (; level < set.leaf_level; ++level) {
    steps += 1;
    uvec2 node = place >> (set.leaf_level - level);
    uvec2 child = (place >> (set.leaf_level - level - 1u)) & 1u;
    uint below = level - set.table_level;
    uvec2 key = node_key(level, node.x, node.y, set.seed);
    flake_ancestors[below + 1u] = flakes_of_child(flake_ancestors[below], key, child);
  }
  walk.flakes = flake_ancestors[set.leaf_level - set.table_level];
  return steps;
}

// What a pair of sides makes of a leaf's corner: how far it is from both, as pairs.
struct LeafCross {
  dvec2 from_low;
  dvec2 from_high;
};

LeafCross leaf_cross(FlakeWalk walk, dvec2 across, dvec2 corner) {
  precise double x = double(walk.at.x) * across.y;
  precise double y = double(walk.at.y) * across.x;
  dvec2 from_low = pair_sum(two_sum(x, -y), -corner.x);
  precise double low_rest = from_low.y - corner.y;
  dvec2 from_high = pair_sum(dvec2(from_low.x, low_rest), -walk.whole.x);
  precise double high_rest = from_high.y - walk.whole.y;
  return LeafCross(dvec2(from_low.x, low_rest), dvec2(from_high.x, high_rest));
}

bool between(LeafCross leaf, double inner) {
  precise double low_rest = inner + leaf.from_low.y;
  precise double high_rest = inner + leaf.from_high.y;
  precise double low = leaf.from_low.x + low_rest;
  precise double high = leaf.from_high.x + high_rest;
  return low >= 0.0lf && high < 0.0lf;
}

// Whether a flake of the leaf that was met lies in the footprint.
bool flake_is_inside(FlakeWalk walk, LeafCross leaf_x, LeafCross leaf_y, uint flake) {
  uvec2 word = flake_place(walk.leaf, flake);
  precise dvec2 place = (dvec2(word) + 0.5lf) * (1.0lf / 4294967296.0lf);
  precise double x = place.x * walk.across_x.y - place.y * walk.across_x.x;
  precise double y = place.x * walk.across_y.y - place.y * walk.across_y.x;
  return between(leaf_x, x) && between(leaf_y, y);
}

// More steps than a walk takes, but for six standard deviations of the number of flakes, which a texture that repeats in
// the footprint makes larger; `tests` are those made of each flake that is inside.
float flake_walk_steps(FlakeSet set, vec2 side_x, vec2 side_y, float flakes, float tests) {
  float leaves = float(1u << set.leaf_level);
  vec2 cells = (abs(side_x) + abs(side_y)) * leaves;
  float area = footprint_area(side_x, side_y) * leaves * leaves;
  float met = area + 2.0 * cells.x + 4.0 * cells.y + 16.0;
  float a_leaf = flakes / (leaves * leaves);
  float looked_at = met * a_leaf;
  float inside = area * a_leaf;
  float repeated = 1.0 + (area / leaves + cells.x + cells.y) / leaves;
  float deviations = 6.0 * sqrt(repeated);
  float below = float(set.leaf_level - set.table_level);
  float walked = met * (below > 0.0 ? 3.0 : 1.0) + (cells.y + 3.0) * (below + 1.0);
  float most_inside = inside + deviations * sqrt(inside) + 16.0;
  return walked + looked_at + deviations * sqrt(looked_at) + 16.0 + tests * most_inside;
}

#endif
