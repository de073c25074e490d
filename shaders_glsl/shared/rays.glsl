// Rays and what they meet, in the words of both bodies of occlusion.
//
// Rays and hits are in scene space. A direction may have any length from 1e-18 to 1e30: t counts lengths of it, in every instance
// alike, and a hit lies strictly between t_min, which is not negative, and t_max. Both sides of a triangle block. What
// an alpha mask cuts out does not, in variants that look at masks; in the others all of a triangle's area blocks.
#ifndef RAYS_GLSL
#define RAYS_GLSL

// Where a ray met a triangle.
struct RayHit {
  float t; // In lengths of the ray's direction.
  uint instance; // As the host counts them.
  uint triangle; // In the list of its mesh.
  vec2 barycentrics; // Weights of its second and third corner.
};

uint rays_traced = 0u; // By this invocation.
uint rays_cut_short = 0u; // Those of them that ran out of steps: what they had not found by then did not block.

// The least direction: where a mesh is 1e12 times as large as its instance, 1e-30 is left of it, and boxes and triangles are
// still tested along the same line.
const float LEAST_DIRECTION = 1e-18;

// Whether a ray is one: finite, with a direction and a span. One that is not meets nothing. Written so that NaN fails.
bool is_ray(vec3 origin, vec3 direction, float t_min, float t_max) {
  bool finite = all(lessThan(abs(origin), vec3(1e30))) && all(lessThan(abs(direction), vec3(1e30)));
  vec3 size = abs(direction);
  return finite && max(size.x, max(size.y, size.z)) >= LEAST_DIRECTION && t_min >= 0.0 && t_min < t_max;
}

#endif
