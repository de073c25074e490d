// The hierarchy of Jakob et al. 2014 over place and normal at once, made node by node as it is walked
// (engine/design/0008-tree-of-jakob.md).
//
// A node is a square of texture space and a spherical triangle, with a number of flakes that follows from its parent's and
// from hashes of its name alone. With epsilon = 0 the count is exact, flake by flake, and the oracle's. Needs shaderInt64
// and shaderFloat64.
#ifndef JAKOB_TREE_GLSL
#define JAKOB_TREE_GLSL
#include "shared/flake_set.glsl"
#include "shared/jakob_overlap.glsl"

layout(std430, binding = 50) readonly buffer Triangles { JakobTriangle triangles[]; };

const uint JAKOB_FEW = 8u; // A node with at most so many flakes holds them one by one.
const uint JAKOB_BOTH = 0u; // Flakes are counted by place and normal.
const uint JAKOB_PLACES = 1u; // By place alone: the tree is never divided by direction.
const uint JAKOB_NORMALS = 2u; // By normal alone: the tree is never divided by place.
const uint JAKOB_MANY = 1000u; // A large triangle's expectation is dearer than to walk a node with fewer flakes.
const float JAKOB_SMOOTH = 2000.0; // With more flakes than this in it, a footprint that cannot be walked shows its expectation.
const int JAKOB_RESERVE = 2000; // Steps that are kept, at most, for what is left to be expected.
const float JAKOB_FINE = 0.02; // A triangle so much smaller than the cone is cut by it as by a straight line.
const uint JAKOB_STEPS = 7000u; // That an invocation may take at most.
const uint JAKOB_STACK = 112u; // Three nodes for each of 19 + 15 levels, and the last one's children.
const float JAKOB_MOST_TILES = 64.0; // A footprint over more squares than this shows the share of a whole one,
const float JAKOB_MANY_FLAKES = 1e6; // and so does one of a square's area or more with more flakes than this.

// Words of a node's key at which its random numbers begin.
const uint SPLIT_DRAW = 64u;
const uint LISTED_DRAW = 1024u;

// Steps left to this invocation. One driver ends an invocation silently after 65,535 loop iterations, and counts those of
// eight invocations that run as one vector together: the longest of them at every step.
int steps_left = int(JAKOB_STEPS);

struct JakobTree {
  uint64_t flakes; // In a square of texture space.
  uint seed; // Of the flakes.
  uint last_level; // Of squares.
  float split_ratio; // Mean solid angle asked for over mean area asked for.
  float epsilon; // Greatest standard error of a node that its expectation may stand for, relative to what is counted.
};

// A parallelogram of texture space, and the squares it touches.
struct JakobFootprint {
  vec2 corner;
  vec2 side_x;
  vec2 side_y;
  float area; // In squares of texture space; 1 where a whole square stands for it.
  bool whole; // A whole square stands for it: it covers many, or is none.
  ivec2 first_tile;
  uvec2 tiles;
};

JakobFootprint jakob_footprint(uint64_t flakes, vec2 corner, vec2 side_x, vec2 side_y) {
  JakobFootprint footprint = JakobFootprint(corner, side_x, side_y, 1.0, true, ivec2(0), uvec2(1u));
  float area = abs(jakob_cross(side_x, side_y));
  vec2 low = floor(corner + min(min(vec2(0.0), side_x + side_y), min(side_x, side_y)));
  vec2 high = floor(corner + max(max(vec2(0.0), side_x + side_y), max(side_x, side_y)));
  vec2 tiles = high - low + 1.0;
  // Written so that a footprint that is no number is none.
  bool few = area < 1.0 || area * float(flakes) <= JAKOB_MANY_FLAKES;
  if (area >= 1e-18 && tiles.x * tiles.y <= JAKOB_MOST_TILES && few) {
    footprint.area = area;
    footprint.whole = false;
    footprint.first_tile = ivec2(low);
    footprint.tiles = uvec2(tiles);
  }
  return footprint;
}

// What is found of a footprint's flakes.
struct JakobCount {
  uint64_t counted; // Those counted one by one or by whole nodes.
  float expected; // What is expected of nodes that were not divided further.
  bool spent; // So few steps were left that some triangles were taken as they lay across the cone: no expectation.
};

// Whether a random word is below a chance in 2^-32, of which the largest is 1.
bool jakob_below(uint word, uint chance) {
  return word < chance || chance == 0xffffffffu;
}

float jakob_chance(uint chance) {
  return chance == 0xffffffffu ? 1.0 : float(chance) * (1.0 / 4294967296.0);
}

// Names a node; its random words are drawn from it.
uvec2 jakob_key(uint level, uvec2 cell, uint id, uint seed) {
  return uvec2(
    hash(cell.x, cell.y, hash(level, hash(id, seed))),
    hash(cell.y, cell.x, hash(id, hash(level, ~seed)))
  );
}

// Flakes on their way to a triangle's children.
struct JakobSplit {
  u64vec4 children; // The last one's are those that no other has.
  uint64_t undecided; // Those of whom it is not known whether they are of this child.
  uint child; // Which binomial it is.
  uint at_bit; // Which bit of its chance.
};

void jakob_next_bit(inout JakobSplit split, uvec2 key, uvec3 splits) {
  uint chance = split.child == 0u ? splits.x : (split.child == 1u ? splits.y : splits.z);
  uint word = SPLIT_DRAW + 64u * split.child + 2u * split.at_bit;
  uint64_t low = half_of(split.undecided, draw(key, word), draw(key, word + 1u));
  bool all = chance == 0xffffffffu;
  bool one = (chance >> (31u - split.at_bit) & 1u) != 0u;
  uint64_t taken = all ? split.undecided : (one ? low : uint64_t(0));
  taken = split.child < 3u ? taken : uint64_t(0);
  split.children.x += split.child == 0u ? taken : uint64_t(0);
  split.children.y += split.child == 1u ? taken : uint64_t(0);
  split.children.z += split.child == 2u ? taken : uint64_t(0);
  split.children.w -= taken;
  split.undecided = all ? uint64_t(0) : (one ? split.undecided - low : low);
  // Once no bit of the chance is left, nobody who still agrees with it is below.
  bool last = split.at_bit == 31u || (chance << (split.at_bit + 1u)) == 0u;
  bool done = split.undecided == uint64_t(0) || last;
  split.at_bit = done ? 0u : split.at_bit + 1u;
  split.child += done ? 1u : 0u;
  split.undecided = done ? split.children.w : split.undecided;
}

// The flakes of a triangle's four children: three binomials, each of what the ones before it left. Binomial(n, p) by the
// bits of p from the highest: of the flakes whose number still agrees with p, about half have 0 next. Where p has 1 these
// are below it; where p has 0 the others are above.
u64vec4 jakob_by_direction(uint64_t n, uvec2 key, uvec3 splits) {
  JakobSplit split = JakobSplit(u64vec4(0, 0, 0, n), n, 0u, 0u);
  while (split.child < 3u) {
    --steps_left;
    jakob_next_bit(split, key, splits);
    jakob_next_bit(split, key, splits);
  }
  return split.children;
}

// Whether flake `flake` of the node lies in the footprint, decided in f64; `square` is the node's level and cell.
bool jakob_lies_inside(uvec2 key, uint flake, uvec3 square, JakobFootprint footprint, ivec2 tile) {
  uint at = LISTED_DRAW + 64u * flake;
  dvec2 place = dvec2(draw(key, at), draw(key, at + 1u));
  place = (dvec2(square.yz) + (place + 0.5) * (1.0lf / 4294967296.0lf)) / double(1u << square.x);
  dvec2 from_corner = place - (dvec2(footprint.corner) - dvec2(tile));
  dvec2 x = dvec2(footprint.side_x);
  dvec2 y = dvec2(footprint.side_y);
  double determinant = x.x * y.y - x.y * y.x;
  double turn = determinant < 0.0 ? -1.0 : 1.0;
  double a = turn * (from_corner.x * y.y - from_corner.y * y.x);
  double b = turn * (x.x * from_corner.y - x.y * from_corner.x);
  return a >= 0.0 && b >= 0.0 && a < turn * determinant && b < turn * determinant;
}

// The normal, of any length, of flake `flake` of the node in a leaf: drawn with density linear in the leaf. The corner that
// brings the flake is drawn first; about it barycentric coordinates are the spacings of three uniform numbers.
vec3 jakob_normal(uvec2 key, uint flake, JakobTriangle leaf) {
  uint at = LISTED_DRAW + 64u * flake + 24u;
  uvec3 numbers = uvec3(draw(key, at), draw(key, at + 1u), draw(key, at + 2u)) >> 8;
  uint least = min(min(numbers.x, numbers.y), numbers.z);
  uint most = max(max(numbers.x, numbers.y), numbers.z);
  uint middle = numbers.x + numbers.y + numbers.z - least - most;
  uint first = 0x1000000u - most;
  uint second = most - middle;
  bool by_0 = jakob_below(draw(key, at + 3u), leaf.splits.x);
  bool by_1 = jakob_below(draw(key, at + 4u), leaf.splits.y);
  // Corner k gets `middle`, k + 1 `second`, k + 2 `first`.
  uint at_1 = by_0 ? second : (by_1 ? middle : first);
  uint at_2 = by_0 ? first : (by_1 ? second : middle);
  precise float u = float(at_1) * (1.0 / 16777216.0);
  precise float v = float(at_2) * (1.0 / 16777216.0);
  precise vec3 along_u = leaf.v1 - leaf.v0;
  precise vec3 along_v = leaf.v2 - leaf.v0;
  precise vec3 to_u = u * along_u;
  precise vec3 to_v = v * along_v;
  precise vec3 partial = leaf.v0 + to_u;
  precise vec3 normal = partial + to_v;
  return normal;
}

// Whether a normal reflects i to within the cone about o: |2 (i.m) m - i - o|^2 <= 4 sin^2(gamma/2), multiplied out.
bool jakob_is_lit(vec3 normal, JakobCone cone) {
  dvec3 m = dvec3(normal);
  dvec3 i = dvec3(cone.i);
  dvec3 o = dvec3(cone.o);
  dvec3 sum = i + o;
  double sine = double(cone.sin_half);
  double i_m = dot(i, m);
  return i_m > 0.0 && dot(m, m) * (dot(sum, sum) - 4.0 * sine * sine) <= 4.0 * i_m * dot(o, m);
}

// How many of a node's few flakes count. Each goes down the table to a leaf, unless a triangle on its way decides.
uint jakob_listed(uint n, uvec2 key, uvec3 square, uint triangle, uint mode, JakobCone cone,
                  JakobFootprint footprint, ivec2 tile) {
  uint found = 0u;
  uint flake = 0u;
  uint at = triangle;
  uint depth = 0u;
  while (flake < n) {
    --steps_left;
    bool decided = false;
    bool counts = false;
    if (depth == 0u && mode != JAKOB_NORMALS && !footprint.whole) {
      decided = !jakob_lies_inside(key, flake, square, footprint, tile);
    }
    if (!decided && mode == JAKOB_PLACES) {
      decided = true;
      counts = true;
    }
    if (!decided) {
      JakobTriangle here = triangles[at];
      float share;
      uint side = jakob_side_of_cone(here, cone, share);
      if (side != JAKOB_PARTLY) {
        decided = true;
        counts = side == JAKOB_INSIDE;
      } else if (here.first_child == 0u) {
        decided = true;
        counts = jakob_is_lit(jakob_normal(key, flake, here), cone);
      } else {
        uint word = LISTED_DRAW + 64u * flake + depth;
        uint other = draw(key, word + 32u);
        uint child = jakob_below(draw(key, word + 2u), here.splits.x)
          ? 0u
          : (jakob_below(other, here.splits.y) ? 1u : (jakob_below(mixed(other), here.splits.z) ? 2u : 3u));
        at = here.first_child + child;
        ++depth;
      }
    }
    if (decided) {
      found += counts ? 1u : 0u;
      ++flake;
      at = triangle;
      depth = 0u;
    }
  }
  return found;
}

// The flakes of a footprint that are lit, the tree walked depth first, children in order. At most about `budget` steps: when
// few of them are left, nodes are divided no further but taken at their expectation, as criterion (10) does with those
// whose standard error is below epsilon times what is found already.
JakobCount jakob_count(JakobTree tree, JakobFootprint footprint, JakobCone cone, uint mode, int budget) {
  JakobCount found = JakobCount(uint64_t(0), 0.0, false);
  uvec4 stack[JAKOB_STACK];
  uint height = 0u;
  int last_step = steps_left - budget;
  int reserve = min(budget / 2, JAKOB_RESERVE);
  bool everywhere = mode == JAKOB_NORMALS || footprint.whole;
  uint tiles = everywhere ? 1u : footprint.tiles.x * footprint.tiles.y;
  uint next_tile = 0u;
  ivec2 tile = ivec2(0);
  // Squares that lie in the footprint as a whole are all alike: one is walked, the others add what it holds.
  bool tile_is_inside = false;
  bool has_whole = false;
  float handed_on = 0.0; // Expected flakes of the next node's triangle in squares before it.
  JakobCount before = found;
  JakobCount whole = found;
  float most_flakes = float(tree.flakes) * (everywhere ? 1.0 : footprint.area);
  bool hopeless = false;
  while (height > 0u || next_tile < tiles) {
    --steps_left;
    int left = steps_left - last_step;
    if (left < reserve && !hopeless && most_flakes > JAKOB_SMOOTH) {
      // So many that they cannot be walked: all of them are expected, and nothing else.
      hopeless = true;
      found = JakobCount(uint64_t(0), 0.0, false);
      handed_on = 0.0;
      next_tile = tiles;
      stack[0] = uvec4(0x80000000u, 0u, floatBitsToUint(most_flakes), 0u);
      height = 1u;
    }
    if (height == 0u) {
      if (tile_is_inside && !has_whole) {
        whole = JakobCount(found.counted - before.counted, found.expected - before.expected, found.spent);
        has_whole = true;
      }
      before = found;
      tile = footprint.first_tile + ivec2(next_tile % footprint.tiles.x, next_tile / footprint.tiles.x);
      ++next_tile;
      vec2 middle = vec2(tile) + 0.5 - footprint.corner;
      tile_is_inside = everywhere
        || jakob_side_of_footprint(middle, 0.5, footprint.side_x, footprint.side_y) == JAKOB_INSIDE;
      if (tile_is_inside && has_whole && handed_on == 0.0) {
        found.counted += whole.counted;
        found.expected += whole.expected;
        continue;
      }
      stack[height++] = uvec4(0u, uint(tree.flakes >> 32) << 20, uint(tree.flakes), 0u);
    }
    // x: column, level above its 19 bits, and at the top whether the number is an expectation; y: row, and upper bits of
    // the number above; z: the number, or the expectation's float; w: triangle.
    uvec4 node = stack[--height];
    uvec2 cell = node.xy & 0x7ffffu;
    uint level = node.x >> 19 & 31u;
    bool expecting = node.x >> 31 != 0u;
    uint64_t count = uint64_t(node.y >> 20) << 32 | uint64_t(node.z);
    JakobTriangle triangle = triangles[node.w];

    float share_lit = 1.0;
    uint side_of_cone = JAKOB_INSIDE;
    if (mode != JAKOB_PLACES) {
      side_of_cone = jakob_side_of_cone(triangle, cone, share_lit);
    }
    uint side_of_footprint = JAKOB_INSIDE;
    float size = uintBitsToFloat((127u - level) << 23);
    vec2 center = (vec2(cell) + 0.5) * size + vec2(tile) - footprint.corner;
    if (!everywhere && !expecting) {
      side_of_footprint = jakob_side_of_footprint(center, 0.5 * size, footprint.side_x, footprint.side_y);
    }
    if (side_of_cone == JAKOB_OUTSIDE || (side_of_footprint == JAKOB_OUTSIDE && handed_on == 0.0)) {
      continue;
    }
    if (side_of_cone == JAKOB_INSIDE && side_of_footprint == JAKOB_INSIDE && !expecting) {
      found.counted += count;
      continue;
    }

    bool leaf = triangle.first_child == 0u;
    bool by_place = level < tree.last_level && mode != JAKOB_NORMALS;
    bool by_direction = !leaf && mode != JAKOB_PLACES;
    float value = uintBitsToFloat(node.z);
    if (!expecting) {
      // Criterion (10), its p estimated.
      float p = share_lit * (side_of_footprint == JAKOB_INSIDE ? 1.0 : min(0.5, footprint.area / (size * size)));
      float sum = float(found.counted) + found.expected;
      bool small = sum > 0.0 && sqrt(float(count) * p * (1.0 - p)) <= tree.epsilon * sum && tree.epsilon > 0.0;
      bool cheap = leaf || side_of_cone == JAKOB_INSIDE || count > uint64_t(JAKOB_MANY);
      bool many_in_leaf = mode == JAKOB_NORMALS && leaf && count > uint64_t(JAKOB_FEW);
      expecting = (small && cheap) || many_in_leaf || left < reserve;
      if (!expecting && handed_on > 0.0) {
        // The node is walked after what was handed on.
        stack[height++] = node;
        stack[height++] = uvec4(0x80000000u, 0u, floatBitsToUint(handed_on), node.w);
        handed_on = 0.0;
        continue;
      }
    }
    if (expecting && node.x >> 31 == 0u) {
      float share = side_of_footprint == JAKOB_INSIDE ? 1.0 : 0.0;
      if (side_of_footprint == JAKOB_PARTLY) {
        share = jakob_share_of_square(center, 0.5 * size, footprint.side_x, footprint.side_y);
      }
      value = float(count) * share + handed_on;
      handed_on = 0.0;
      // What is expected of one triangle in several squares is looked into once.
      uint next = height > 0u ? stack[height - 1u].w : (next_tile < tiles && !tile_is_inside ? 0u : 0xffffffffu);
      bool next_expects = height > 0u && stack[height - 1u].x >> 31 != 0u;
      if (next == node.w && !next_expects && side_of_cone == JAKOB_PARTLY) {
        handed_on = value;
        continue;
      }
    }
    u64vec4 children = u64vec4(0);
    bool divided_by_place = false;
    if (expecting) {
      uint first = triangle.first_child;
      uint below = triangles[first].first_child | triangles[first + 1u].first_child;
      below |= triangles[first + 2u].first_child | triangles[first + 3u].first_child;
      // Where only leaves are below, the density is nearly linear already: good enough when steps are few.
      bool nearly_leaf = leaf || (below == 0u && left < reserve);
      bool closing = left <= int(height + tiles - next_tile);
      if (side_of_cone == JAKOB_INSIDE) {
        found.expected += value;
      } else if (closing || triangle.chord_radius < JAKOB_FINE * cone.sin_half) {
        found.expected += value * share_lit;
        found.spent = found.spent || triangle.chord_radius >= JAKOB_FINE * cone.sin_half;
      } else if (nearly_leaf) {
        vec3 weights = leaf ? jakob_corner_weights(triangle.splits) : jakob_linear_weights(triangle.splits);
        found.expected += value * jakob_share_of_leaf(triangle, cone, weights, share_lit);
      } else {
        vec4 values = vec4(0.0, 0.0, 0.0, value);
        for (uint child = 0u; child < 3u; ++child) {
          values[child] = values.w * jakob_chance(triangle.splits[child]);
          values.w -= values[child];
        }
        children = u64vec4(floatBitsToUint(max(values, 0.0)));
      }
    } else {
      uvec2 key = jakob_key(level, cell, triangle.id, tree.seed);
      // Multiplied by a power of two, the ratio is exact.
      divided_by_place = by_place && (!by_direction || tree.split_ratio * (size * size) > triangle.solid_angle);
      if (count <= uint64_t(JAKOB_FEW) || !(by_place || by_direction)) {
        uvec3 square = uvec3(level, cell);
        found.counted += uint64_t(jakob_listed(uint(count), key, square, node.w, mode, cone, footprint, tile));
      } else if (divided_by_place) {
        children = children_of(count, key);
      } else {
        children = jakob_by_direction(count, key, triangle.splits);
      }
    }
    for (uint after = 0u; after < 4u; ++after) {
      uint child = 3u - after;
      if (children[child] != uint64_t(0)) {
        uvec2 place = divided_by_place ? 2u * cell + uvec2(child & 1u, child >> 1) : cell;
        uint deeper = level + (divided_by_place ? 1u : 0u);
        stack[height++] = uvec4(
          place.x | deeper << 19 | (expecting ? 0x80000000u : 0u),
          place.y | uint(children[child] >> 32) << 20,
          uint(children[child]),
          divided_by_place ? node.w : triangle.first_child + child
        );
      }
    }
  }
  return found;
}

#endif
