// The nodes of the flakes' quadtree (engine/design/0007-flake-set.md) that a footprint touches, down to a level that the
// caller chooses.
#ifndef FLAKE_TREE_GLSL
#define FLAKE_TREE_GLSL
#include "shared/exact_product.glsl"
#include "shared/cells.glsl"
#include "shared/flake_set.glsl"
#include "shared/footprint.glsl"
#include "shared/glint_surface.glsl"
#include "shared/loop_budget.glsl"

const uint TREE_LEVELS = 20u; // The deepest is level 19, that of the leaves of 1e12 flakes.

// A parallelogram in texture space, moved by whole squares so that its middle lies in the first one.
struct Footprint {
  vec2 corner;
  vec2 side_x;
  vec2 side_y;
  vec2 low; // Its bounds.
  vec2 high;
  float area; // In squares of texture.
  vec2 along_x; // Dot product with a place seen from the corner: how far along side_x, 0 to 1 inside.
  vec2 along_y;
};

// A node that a footprint touches.
struct FlakeNode {
  uint level;
  uvec2 cell; // Its place on its level.
  uint64_t flakes;
  vec2 offset; // From the footprint's corner to the node's.
  float side; // Its own, in squares of texture.
  bool whole; // It lies in the footprint.
};

// Steps left to this invocation.
int steps_left = STEPS_A_INVOCATION;

// What the method makes of a node at the end of the traversal.
void visit(FlakeNode node);

Footprint footprint_of(GlintSurface surface) {
  Footprint footprint;
  footprint.side_x = surface.uv_dx;
  footprint.side_y = surface.uv_dy;
  vec2 middle = within_cell(surface.uv);
  footprint.corner = middle - 0.5 * (surface.uv_dx + surface.uv_dy);
  vec2 reach = 0.5 * (abs(surface.uv_dx) + abs(surface.uv_dy));
  footprint.low = middle - reach;
  footprint.high = middle + reach;
  float determinant = determinant_of(surface.uv_dx.x, surface.uv_dx.y, surface.uv_dy.x, surface.uv_dy.y);
  footprint.area = abs(determinant);
  footprint.along_x = vec2(surface.uv_dy.y, -surface.uv_dy.x) / determinant;
  footprint.along_y = vec2(-surface.uv_dx.y, surface.uv_dx.x) / determinant;
  return footprint;
}

// Steps that a traversal down to this level takes on average: a convex shape over squares of side 1 touches as many as its
// area and its extents along both axes add up to, plus 1 (Steiner's formula for the two shapes' sum); each that is split
// costs its children's steps too. All squares of texture within the bounds are looked at.
float steps_to(Footprint footprint, uint level) {
  float cells = exp2(float(level));
  vec2 extent = footprint.high - footprint.low;
  float squares = (extent.x + 1.0) * (extent.y + 1.0);
  return squares + 1.34 * footprint.area * cells * cells + 4.0 * cells * (extent.x + extent.y) + 4.0 * float(level + 1u);
}

// The deepest level, at most `deepest`, that so many steps lead to. Level 0 where none does.
uint level_within(Footprint footprint, uint deepest, float steps) {
  uint level = deepest;
  while (level > 0u && !(steps_to(footprint, level) <= steps)) {
    --level;
  }
  return level;
}

// The share of a node that lies in the footprint.
float share_of(FlakeNode node, Footprint footprint) {
  if (node.whole) {
    return 1.0;
  }
  vec2 low = footprint.low - footprint.corner - node.offset;
  vec2 high = footprint.high - footprint.corner - node.offset;
  if (all(greaterThanEqual(low, vec2(0.0))) && all(lessThanEqual(high, vec2(node.side)))) {
    return footprint.area / (node.side * node.side);
  }
  vec2 x = footprint.side_x / node.side;
  vec2 y = footprint.side_y / node.side;
  return share_inside(vec4(0.0, 0.0, 1.0, 1.0), -node.offset / node.side, x, y);
}

// Visits the nodes of one level that hold flakes and touch the footprint, depth first, in each repetition of the texture.
void visit_touched(Footprint footprint, uint64_t root, uint end, uint seed) {
  ivec2 first = ivec2(floor(footprint.low));
  uvec2 span = uvec2(ivec2(floor(footprint.high)) - first) + 1u;
  uint squares = span.x * span.y;
  // The flakes of the children of the nodes that were split, by the latter's level.
  u64vec4 children[TREE_LEVELS];
  uint square = 0u;
  uint level = 0u;
  uvec2 cell = uvec2(0u);
  uint64_t flakes = root;
  while (square < squares && steps_left > 0) {
    --steps_left;
    float side = exp2(-float(level));
    vec2 offset = vec2(first + ivec2(square % span.x, square / span.x)) - footprint.corner + vec2(cell) * side;
    vec2 middle = offset + 0.5 * side;
    vec2 at = vec2(dot(footprint.along_x, middle), dot(footprint.along_y, middle));
    vec2 reach = 0.5 * side
      * vec2(abs(footprint.along_x.x) + abs(footprint.along_x.y), abs(footprint.along_y.x) + abs(footprint.along_y.y));
    vec2 corner = offset + footprint.corner;
    bool touched = flakes > uint64_t(0)
      && all(greaterThan(at + reach, vec2(0.0))) && all(lessThan(at - reach, vec2(1.0)))
      && all(lessThan(corner, footprint.high)) && all(greaterThan(corner + side, footprint.low));
    if (touched && level < end) {
      children[level] = children_of(flakes, node_key(level, cell.x, cell.y, seed));
      flakes = children[level].x;
      ++level;
      cell *= 2u;
      continue;
    }
    if (touched) {
      bool whole = all(greaterThanEqual(at - reach, vec2(0.0))) && all(lessThanEqual(at + reach, vec2(1.0)));
      visit(FlakeNode(level, cell, flakes, offset, side, whole));
    }
    // Up past those whose last child this was, and on to the next.
    uint up = min(uint(findLSB(~(cell.x & cell.y))), level);
    level -= up;
    cell >>= up;
    if (level == 0u) {
      ++square;
      flakes = root;
    } else {
      uint child = (cell.x & 1u | (cell.y & 1u) << 1) + 1u;
      cell = (cell & ~1u) | uvec2(child & 1u, child >> 1);
      flakes = children[level - 1u][child];
    }
  }
}

#endif
