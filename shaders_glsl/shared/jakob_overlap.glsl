// How a node of the hierarchy of Jakob et al. 2014 lies to what is asked for: its square to a footprint, its spherical
// triangle to the normals that reflect i into a cone about o, and the shares of both inside.
#ifndef JAKOB_OVERLAP_GLSL
#define JAKOB_OVERLAP_GLSL

const uint JAKOB_OUTSIDE = 0u; // Surely nothing of it is inside.
const uint JAKOB_PARTLY = 1u; // Some of it may be.
const uint JAKOB_INSIDE = 2u; // Surely all of it is.

// A spherical triangle of the table, which depends on alpha alone.
struct JakobTriangle {
  vec3 v0; // First corner.
  uint id; // 1 for the hemisphere, 4 id + j - 2 for child j.
  vec3 v1; // Second corner.
  uint first_child; // Index of the first of its four children; 0 for a leaf.
  vec3 v2; // Third corner.
  float solid_angle; // Steradians.
  vec3 axis; // Of a cone about it.
  float chord_radius; // From the axis to the rim of that cone.
  uvec3 splits; // Chances in 2^-32: of child 0, of 1 if not 0, of 2 if neither; of a leaf, weights of its corners.
  uint reserved;
};

// The normals that reflect i into the cone about o.
struct JakobCone {
  vec3 i; // Unit, about n = +Z.
  vec3 o; // Unit.
  float sin_half; // sin(gamma/2).
  float cos_half; // cos(gamma/2).
};

float jakob_cross(vec2 a, vec2 b) {
  return a.x * b.y - a.y * b.x;
}

// Reflecting i about a normal turns by twice the angle that the normal turns by: with r the reflection about the axis,
// the triangle is outside if r is farther than gamma + 2b from o and inside if it is nearer than gamma - 2b, b being the
// half-angle of the triangle's cone. Chords stand for angles. `share` is a rough estimate of the part inside.
uint jakob_side_of_cone(JakobTriangle triangle, JakobCone cone, out float share) {
  const float MARGIN = 2e-6; // Of f32, several times.
  float radius = triangle.chord_radius;
  float cos_b = 1.0 - 0.5 * radius * radius;
  float sin_b = radius * sqrt(max(1.0 - 0.25 * radius * radius, 0.0));
  float i_axis = dot(cone.i, triangle.axis);
  float chord = length(2.0 * i_axis * triangle.axis - cone.i - cone.o);
  bool below_right_angle = cone.cos_half * cos_b > cone.sin_half * sin_b;
  float reach = 2.0 * (cone.sin_half * cos_b + cone.cos_half * sin_b);
  float within = 2.0 * (cone.sin_half * cos_b - cone.cos_half * sin_b);
  float relative = cone.sin_half / sin_b;
  share = clamp(0.5 * (relative + 1.0 - 0.5 * chord / sin_b), 0.0, 1.0) * min(relative * relative, 1.0);
  if ((below_right_angle && chord > reach + MARGIN) || i_axis < -sin_b - MARGIN) {
    share = 0.0;
    return JAKOB_OUTSIDE;
  }
  // Lit flakes face i.
  if (chord < within - MARGIN && cos_b > 0.0 && i_axis > sin_b + MARGIN) {
    share = 1.0;
    return JAKOB_INSIDE;
  }
  return JAKOB_PARTLY;
}

// Area and first moments of what an edge from p to q and the origin span inside the unit disk, signed.
vec3 jakob_slice_of_disk(vec2 p, vec2 q) {
  vec2 along = q - p;
  float squared = max(dot(along, along), 1e-30);
  float middle = -dot(p, along) / squared;
  float distance = jakob_cross(p, along);
  float half_chord = sqrt(max(squared - distance * distance, 0.0)) / squared;
  vec2 enters = p + along * clamp(middle - half_chord, 0.0, 1.0);
  vec2 leaves = p + along * clamp(middle + half_chord, 0.0, 1.0);
  vec3 sum = 0.5 * jakob_cross(enters, leaves) * vec3(1.0, (enters + leaves) / 3.0);
  vec2 from = normalize(p + vec2(1e-20, 0.0));
  vec2 to = normalize(enters + vec2(1e-20, 0.0));
  sum += vec3(0.5 * atan(jakob_cross(from, to), dot(from, to)), vec2(to.y - from.y, from.x - to.x) / 3.0);
  from = normalize(leaves + vec2(1e-20, 0.0));
  to = normalize(q + vec2(1e-20, 0.0));
  return sum + vec3(0.5 * atan(jakob_cross(from, to), dot(from, to)), vec2(to.y - from.y, from.x - to.x) / 3.0);
}

// The three weights that two chances stand for.
vec3 jakob_corner_weights(uvec3 splits) {
  vec2 chance = vec2(splits.xy) * (1.0 / 4294967296.0);
  float first = chance.x;
  float second = (1.0 - first) * chance.y;
  return vec3(first, second, max(1.0 - first - second, 0.0));
}

// The three chances that an inner triangle's splits stand for: of its first child, in the middle, and of those at its
// corners 0 and 1. Were its density linear, with a weight w at a corner, the child there would hold (1 + 3 w) / 8 of it.
vec3 jakob_linear_weights(uvec3 splits) {
  vec3 chance = vec3(splits) * (1.0 / 4294967296.0);
  float rest = 1.0 - chance.x;
  vec2 held = vec2(rest * chance.y, rest * (1.0 - chance.y) * chance.z);
  vec3 weights = vec3(held, rest - held.x - held.y) * (8.0 / 3.0) - 1.0 / 3.0;
  return max(weights, 0.0) / dot(max(weights, 0.0), vec3(1.0));
}

// The share of a leaf's flakes inside the cone. On the leaf's plane, at w = (1, u, v) of its corners, the cone's rim is the
// conic w' M' C M w = 0 with C = (i.o + cos gamma) I - (i o' + o i') (Jakob et al. 2014, Eq. 13, undivided). An affine map
// makes it the unit circle; the flakes' density is linear, with these weights at the corners. Where it is no ellipse, `estimate` is returned.
float jakob_share_of_leaf(JakobTriangle leaf, JakobCone cone, vec3 weights, float estimate) {
  dvec3 i = dvec3(cone.i);
  dvec3 o = dvec3(cone.o);
  dvec3 v0 = dvec3(leaf.v0);
  dvec3 e1 = dvec3(leaf.v1) - v0;
  dvec3 e2 = dvec3(leaf.v2) - v0;
  dvec3 sum = i + o;
  double k = 0.5 * dot(sum, sum) - 2.0 * double(cone.sin_half) * double(cone.sin_half);
  dvec3 on_i = dvec3(dot(i, v0), dot(i, e1), dot(i, e2));
  dvec3 on_o = dvec3(dot(o, v0), dot(o, e1), dot(o, e2));
  double xx = k * dot(e1, e1) - 2.0 * on_i.y * on_o.y;
  double xy = k * dot(e1, e2) - on_i.y * on_o.z - on_i.z * on_o.y;
  double yy = k * dot(e2, e2) - 2.0 * on_i.z * on_o.z;
  dvec2 slope = dvec2(
    k * dot(v0, e1) - on_i.x * on_o.y - on_i.y * on_o.x,
    k * dot(v0, e2) - on_i.x * on_o.z - on_i.z * on_o.x
  );
  double determinant = xx * yy - xy * xy;
  if (xx <= 0.0 || determinant <= 1e-12 * xx * yy) {
    return estimate;
  }
  dvec2 center = dvec2(xy * slope.y - yy * slope.x, xy * slope.x - xx * slope.y) / determinant;
  double depth = -(k * dot(v0, v0) - 2.0 * on_i.x * on_o.x + dot(slope, center));
  if (depth <= 0.0) {
    return 0.0;
  }
  // The Cholesky factor of the quadratic part maps the ellipse to the disk.
  double first = sqrt(xx / depth);
  double shear = xy / xx * first;
  double second = sqrt(determinant / (xx * depth));
  vec2 y0 = vec2(-first * center.x - shear * center.y, -second * center.y);
  vec2 y1 = vec2(first * (1.0 - center.x) - shear * center.y, y0.y);
  vec2 y2 = vec2(-first * center.x + shear * (1.0 - center.y), second * (1.0 - center.y));
  vec3 inside = jakob_slice_of_disk(y0, y1) + jakob_slice_of_disk(y1, y2) + jakob_slice_of_disk(y2, y0);
  float twice_area = jakob_cross(y1 - y0, y2 - y0);
  // Integrals of the barycentric coordinates over what is inside, relative to those over the whole triangle.
  vec3 shares = 3.0 * vec3(
    jakob_cross(y1, y2) * inside.x + jakob_cross(inside.yz, y1 - y2),
    jakob_cross(y2, y0) * inside.x + jakob_cross(inside.yz, y2 - y0),
    jakob_cross(y0, y1) * inside.x + jakob_cross(inside.yz, y0 - y1)
  ) / (0.5 * twice_area * twice_area);
  return clamp(dot(shares, weights), 0.0, 1.0);
}

// A square, its centre taken from the parallelogram's corner, to that parallelogram.
uint jakob_side_of_footprint(vec2 center, float half_size, vec2 side_x, vec2 side_y) {
  float margin = 4.8e-7 * (1.0 + dot(abs(side_x) + abs(side_y), vec2(1.0))); // Of f32, several times.
  float determinant = jakob_cross(side_x, side_y);
  float turn = determinant < 0.0 ? -1.0 : 1.0;
  vec2 place = turn * vec2(jakob_cross(center, side_y), jakob_cross(side_x, center));
  vec2 reach = vec2(abs(side_y.x) + abs(side_y.y), abs(side_x.x) + abs(side_x.y)) * (half_size + margin);
  vec2 low = min(min(vec2(0.0), side_x + side_y), min(side_x, side_y));
  vec2 high = max(max(vec2(0.0), side_x + side_y), max(side_x, side_y));
  vec2 least = place - reach;
  vec2 most = place + reach;
  vec2 edge = vec2(half_size + margin);
  if (
    any(lessThan(most, vec2(0.0))) || any(greaterThan(least, vec2(turn * determinant)))
    || any(lessThan(center + edge, low)) || any(greaterThan(center - edge, high))
  ) {
    return JAKOB_OUTSIDE;
  }
  bool inside = all(greaterThanEqual(least, vec2(0.0))) && all(lessThanEqual(most, vec2(turn * determinant)));
  return inside ? JAKOB_INSIDE : JAKOB_PARTLY;
}

// The integral of y, cut to [0, 1].
float jakob_cut_integral(float y) {
  float cut = clamp(y, 0.0, 1.0);
  return 0.5 * cut * cut + max(y - 1.0, 0.0);
}

// Signed area between an edge and y = 0 inside the unit square.
float jakob_area_under(vec2 p, vec2 q) {
  vec2 from = p.x < q.x ? p : q;
  vec2 to = p.x < q.x ? q : p;
  float left = clamp(from.x, 0.0, 1.0);
  float right = clamp(to.x, 0.0, 1.0);
  float slope = (to.y - from.y) / max(to.x - from.x, 1e-20);
  float y_left = from.y + (left - from.x) * slope;
  float y_right = from.y + (right - from.x) * slope;
  float rise = y_right - y_left;
  float height = abs(rise) < 1e-3
    ? clamp(0.5 * (y_left + y_right), 0.0, 1.0)
    : (jakob_cut_integral(y_right) - jakob_cut_integral(y_left)) / rise;
  return (p.x < q.x ? right - left : left - right) * height;
}

// The share of a square in the parallelogram.
float jakob_share_of_square(vec2 center, float half_size, vec2 side_x, vec2 side_y) {
  vec2 corner = 0.5 - 0.5 * center / half_size;
  vec2 x = corner + 0.5 * side_x / half_size;
  vec2 y = corner + 0.5 * side_y / half_size;
  vec2 opposite = x + y - corner;
  vec2 low = min(min(corner, opposite), min(x, y));
  vec2 high = max(max(corner, opposite), max(x, y));
  if (all(greaterThanEqual(low, vec2(0.0))) && all(lessThanEqual(high, vec2(1.0)))) {
    return min(0.25 * abs(jakob_cross(side_x / half_size, side_y / half_size)), 1.0);
  }
  float area = jakob_area_under(corner, x) + jakob_area_under(x, opposite);
  area += jakob_area_under(opposite, y) + jakob_area_under(y, corner);
  return min(abs(area), 1.0);
}

#endif
