// P(i, o, gamma): the probability that a flake reflects i into the cone of half-angle gamma about o, for Beckmann normals.
#ifndef LIT_PROBABILITY_GLSL
#define LIT_PROBABILITY_GLSL
#include "shared/constants.glsl"
#include "shared/error_function.glsl"
#include "shared/lit_probability_cone.glsl"
#include "shared/reflecting_set.glsl"
#ifdef NAIVE_FORMS
#include "shared/naive_forms.glsl"
#endif

// Nodes of the quadrature: 8, 16 or 32.
#ifndef LIT_PROBABILITY_NODES
#define LIT_PROBABILITY_NODES 16
#endif

const float FARTHEST_SLOPE = 10.0; // In alpha: erfc is 2e-45 there.

// The slope beyond which nothing counts of a set whose nearest is `nearest`: a Gaussian that is exp(-15.2) = 2.5e-7 of itself
// there. Nodes between lie where the density is, however far out the set begins and however long it is.
float slope_reach(float nearest, float alpha) {
  return sqrt(nearest * nearest + 15.2 * alpha * alpha);
}

// A set that is open, or so long that its far end does not matter: along one axis of slopes and across it, as seen from the
// slope of h, small p^2 + large q^2 - 4 sin^2(gamma/2) (h.x p + h.y q) <= 2 sin^2(gamma/2) (1 + h^2).
struct OpenSet {
  vec2 h; // Its slope, along and across.
  float across; // From there to the middle of the set across.
  vec3 width2; // Of half the width, squared: its coefficients of 1, p and p^2.
};

OpenSet open_set(vec2 slope, vec2 along, vec2 across, float large, float small, float sin2_half_gamma) {
  vec2 h = vec2(dot(slope, along), dot(slope, across));
  float doubled = 2.0 * sin2_half_gamma / large;
  float middle = doubled * h.y;
  vec3 width2 = vec3(middle * middle + doubled * (1.0 + dot(h, h)), 2.0 * doubled * h.x, -small / large);
  return OpenSet(h, middle, width2);
}

// Where the set that holds the slope of h begins and ends along its axis, or a point beyond all that counts.
vec2 ends_along(OpenSet set, float alpha) {
  vec3 c = set.width2;
  float discriminant = c.y * c.y - 4.0 * c.z * c.x;
  vec2 ends = vec2(-1e15, 1e15);
  if (discriminant > 0.0) {
    float q = -0.5 * (c.y + (c.y < 0.0 ? -1.0 : 1.0) * sqrt(discriminant));
    vec2 roots = vec2(c.x / q, abs(c.z) > 1e-20 ? q / c.z : 1e15);
    ends.x = max(max(ends.x, roots.x < 0.0 ? roots.x : ends.x), roots.y < 0.0 ? roots.y : ends.x);
    ends.y = min(min(ends.y, roots.x > 0.0 ? roots.x : ends.y), roots.y > 0.0 ? roots.y : ends.y);
  }
  ends += set.h.x;
  float reach = 3.0 * slope_reach(max(max(ends.x, -ends.y), 0.0), alpha);
  return clamp(ends, -reach, reach);
}

// Where it begins and ends across, at one slope along.
vec2 ends_across(OpenSet set, float along) {
  float p = along - set.h.x;
  float half_width = sqrt(max(set.width2.x + p * (set.width2.y + p * set.width2.z), 0.0));
  float middle = set.h.y + set.across;
  return vec2(middle - half_width, middle + half_width);
}

// What faces a direction of an interval across, at one slope along.
vec2 facing(vec3 direction, float along, vec2 ends) {
  float across = abs(direction.y) < 1e-12 ? 1e-12 : direction.y;
  float edge = -(direction.z + direction.x * along) / across;
  return across > 0.0 ? vec2(max(ends.x, edge), ends.y) : vec2(ends.x, min(ends.y, edge));
}

// In slope space the normals are a Gaussian and those that reflect i into the cone fill an ellipse: its equation is
// (s, 1)' C (s, 1) <= 0 with C = (i.o + cos gamma) I - (i o' + o i') (Jakob et al. 2014, Eq. 13, undivided), and
// C h = -2 sin^2(gamma/2) h lets it be written about the slope of h without cancellation. Gauss-Legendre in the angle
// along the long axis, error functions across it.
//
// Directions are unit vectors about n = +Z. Relative error of 16 nodes against the f64 oracle: 1.4e-5 at worst in
// the tests of the 1-degree tables (alpha from .02, polar angles to 80 degrees), 3e-5 down to 1e-4 degrees (alpha from .05). It grows
// where gamma is over 1.5 alpha: to 80 degrees 95 of 100 are within 1e-4 at 3 alpha, 5e-4 at 5 alpha, 2e-3 at 8 alpha.
// Where the ellipse opens (both directions about gamma from the horizon) it is cut to what counts and to the normals that face
// both, and the same nodes serve: 95 of 100 within 8e-3, and half within 1e-5, for cones of 15 and 30 degrees.
float lit_probability(vec3 i, vec3 o, float sin2_half_gamma, float alpha) {
  const int HALF = LIT_PROBABILITY_NODES / 2;
  // The positive nodes; the others are their negatives.
#if LIT_PROBABILITY_NODES == 8
  const float NODES[4] = float[](
    0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975362
  );
  const float WEIGHTS[4] = float[](
    0.3626837833783617, 0.3137066458778869, 0.2223810344533744, 0.1012285362903771
  );
#elif LIT_PROBABILITY_NODES == 16
  const float NODES[8] = float[](
    0.0950125098376374, 0.2816035507792589, 0.4580167776572274, 0.6178762444026438,
    0.7554044083550030, 0.8656312023878318, 0.9445750230732326, 0.9894009349916499
  );
  const float WEIGHTS[8] = float[](
    0.1894506104550685, 0.1826034150449236, 0.1691565193950025, 0.1495959888165767,
    0.1246289712555339, 0.0951585116824928, 0.0622535239386479, 0.0271524594117541
  );
#else
  const float NODES[16] = float[](
    0.0483076656877383, 0.1444719615827965, 0.2392873622521371, 0.3318686022821277,
    0.4213512761306353, 0.5068999089322294, 0.5877157572407623, 0.6630442669302152,
    0.7321821187402897, 0.7944837959679424, 0.8493676137325700, 0.8963211557660521,
    0.9349060759377397, 0.9647622555875064, 0.9856115115452684, 0.9972638618494816
  );
  const float WEIGHTS[16] = float[](
    0.0965400885147277, 0.0956387200792747, 0.0938443990808045, 0.0911738786957638,
    0.0876520930044038, 0.0833119242269467, 0.0781938957870702, 0.0723457941088483,
    0.0658222227763617, 0.0586840934785356, 0.0509980592623761, 0.0428358980222268,
    0.0342738629130218, 0.0253920653092620, 0.0162743947309057, 0.0070186100094705
  );
#endif
  vec3 sum = i + o;
  float length2 = dot(sum, sum);
  if (length2 < 1e-12 || sum.z <= 0.0) {
    return 0.0;
  }
  vec2 slope = sum.xy / sum.z;
  float k = conic_across(sum, sin2_half_gamma);
  float a = k - 2.0 * i.x * o.x;
  float d = k - 2.0 * i.y * o.y;
  float b = -(i.x * o.y + i.y * o.x);
  float determinant = a * d - b * b;
  bool open = k <= 0.0 || determinant <= 1e-7 * k * k;

  float difference = length(vec2(a - d, 2.0 * b));
  float large = 0.5 * (a + d + difference);
  float small = determinant / large;
  // Eigenvector of the small eigenvalue, by whichever row is longer.
  vec2 first = vec2(b, small - a);
  vec2 second = vec2(small - d, b);
  vec2 along = dot(first, first) > dot(second, second) ? first : second;
  float along2 = dot(along, along);
  along = along2 > 1e-20 ? along * inversesqrt(along2) : vec2(1.0, 0.0);
  vec2 across = vec2(-along.y, along.x);

  vec2 shift = 2.0 * sin2_half_gamma * vec2(d * slope.x - b * slope.y, a * slope.y - b * slope.x) / determinant;
  float scale = 2.0 * sin2_half_gamma * (1.0 + dot(slope, slope) + dot(shift, slope));
  vec2 center = slope + shift;
  float half_long = sqrt(scale / small);
  float half_short = sqrt(scale / large);
  float y = dot(center, along);
  float x = dot(center, across);
  OpenSet set = open_set(slope, along, across, large, small, sin2_half_gamma);
  if (open) {
    vec2 ends = ends_along(set, alpha);
    y = 0.5 * (ends.x + ends.y);
    half_long = 0.5 * (ends.y - ends.x);
  }
#ifdef NAIVE_FORMS
  float reach = naive_slope_reach(alpha);
#else
  float reach = slope_reach(max(abs(y) - half_long, 0.0), alpha);
#endif
  float from = asin(clamp((-reach - y) / half_long, -1.0, 1.0));
  float to = asin(clamp((reach - y) / half_long, -1.0, 1.0));
  // What faces light and view: dot(facing, (slope along, slope across, 1)) > 0.
  vec3 facing_i = vec3(dot(i.xy, along), dot(i.xy, across), i.z);
  vec3 facing_o = vec3(dot(o.xy, along), dot(o.xy, across), o.z);

  float middle = 0.5 * (from + to);
  float half_range = 0.5 * (to - from);
  float total = 0.0;
  for (int node = 0; node < LIT_PROBABILITY_NODES; ++node) {
    float t = middle + half_range * (node < HALF ? NODES[node] : -NODES[node - HALF]);
    float s = y + half_long * sin(t);
    vec2 about = vec2(x, half_short * cos(t)) / alpha;
    if (open) {
      vec2 between = facing(facing_o, s, facing(facing_i, s, ends_across(set, s)));
      between = clamp(between / alpha, -FARTHEST_SLOPE, FARTHEST_SLOPE);
      about = vec2(0.5 * (between.x + between.y), max(0.5 * (between.y - between.x), 0.0));
    }
    float inner = 0.5 * erf_about(about.x, about.y);
    total += WEIGHTS[node & (HALF - 1)] * cos(t) * exp(-s * s / (alpha * alpha)) * inner;
  }
  return min(total * half_range * half_long / (alpha * sqrt(PI)), 1.0);
}

#endif
