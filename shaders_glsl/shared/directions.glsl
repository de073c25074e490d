// Frames about a normal, directions as two numbers, low-discrepancy points.
#ifndef DIRECTIONS_GLSL
#define DIRECTIONS_GLSL
#include "shared/constants.glsl"

// Columns: two tangents and the unit normal. Duff et al. 2017, "Building an Orthonormal Basis, Revisited": no singular
// direction, orthonormal to 6e-8, or 3e-7 where a quotient is only good to Vulkan's 2.5 units in the last place.
mat3 frame_about(vec3 normal) {
  float side = normal.z < 0.0 ? -1.0 : 1.0;
  float a = -1.0 / (side + normal.z);
  float b = normal.x * normal.y * a;
  vec3 tangent = vec3(1.0 + side * normal.x * normal.x * a, side * b, -side * normal.x);
  vec3 bitangent = vec3(b, side + normal.y * normal.y * a, -normal.y);
  return mat3(tangent, bitangent, normal);
}

// The same with its first column along the tangent's part across the unit normal, its second turned from there by the
// handedness, 1 or -1. A tangent along the normal, or none, gives way to frame_about: what is across of it is rounding.
// Orthonormal to 4e-7 on lavapipe, to 1e-6 where normalize is no better than Vulkan's promise: one subtraction leaves as
// much of the normal as rounding is of what is across, two leave none (Giraud et al. 2005, "twice is enough").
mat3 frame_along(vec3 normal, vec3 tangent, float handedness) {
  float size = max(max(abs(tangent.x), abs(tangent.y)), abs(tangent.z));
  vec3 scaled = tangent / size;
  vec3 across = scaled - normal * dot(normal, scaled);
  // Written so that NaN fails: a tangent of 0 or infinity is none.
  if (!(size > 1e-30 && size < 1e30 && dot(across, across) >= 1e-8 * dot(scaled, scaled))) {
    return frame_about(normal);
  }
  across = normalize(across);
  across = normalize(across - normal * dot(normal, across));
  return mat3(across, handedness * cross(normal, across), normal);
}

// A unit vector on the octahedron, unfolded to -1..1 (Cigolle et al. 2014).
vec2 octahedral_from(vec3 direction) {
  vec2 flat_part = direction.xy / (abs(direction.x) + abs(direction.y) + abs(direction.z));
  vec2 signs = vec2(flat_part.x < 0.0 ? -1.0 : 1.0, flat_part.y < 0.0 ? -1.0 : 1.0);
  return direction.z < 0.0 ? (1.0 - abs(flat_part.yx)) * signs : flat_part;
}

vec3 direction_from(vec2 octahedral) {
  vec3 direction = vec3(octahedral, 1.0 - abs(octahedral.x) - abs(octahedral.y));
  float below = max(-direction.z, 0.0);
  direction.x += direction.x < 0.0 ? below : -below;
  direction.y += direction.y < 0.0 ? below : -below;
  return normalize(direction);
}

// A direction at most gamma from the axis, all being as likely. From sin^2(gamma/2), as 1 - cos(gamma) loses digits.
vec3 direction_in_cone(vec3 axis, float sin2_half_gamma, vec2 u) {
  float from_axis = 2.0 * sin2_half_gamma * u.x;
  float sine = sqrt(from_axis * (2.0 - from_axis));
  float turn = 2.0 * PI * u.y;
  return frame_about(axis) * vec3(sine * cos(turn), sine * sin(turn), 1.0 - from_axis);
}

// Point `index` of `count` of the Hammersley set, inside the unit square.
vec2 hammersley(uint index, uint count) {
  return vec2((float(index) + 0.5) / float(count), (float(bitfieldReverse(index) >> 8) + 0.5) * (1.0 / 16777216.0));
}

#endif
