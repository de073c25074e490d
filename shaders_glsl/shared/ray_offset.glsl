// Where a ray that leaves a surface starts, so that it does not meet the surface it left.
#ifndef RAY_OFFSET_GLSL
#define RAY_OFFSET_GLSL

// Moves a point along the normal by 256 units in the last place of its largest coordinate, as Waechter and Binder 2019
// ("A Fast and Robust Method for Avoiding Self-Intersection") found enough. The largest, where they take each by its
// own: a point on a tilted triangle is as uncertain in its small coordinates as in its large ones. And never less than
// at `reach`, which stands for the numbers that the point was computed from: triangle_reach of the surface it lies on.
//
// So the way is 2^-16 to 2^-15 of the reach, 0.015 to 0.03 mm at 1 m from the scene's centre, however large the scene is
// around it. In units of rounding (2^-24) of the reach it is at least 256. Across its triangle, the point is off by 19 of
// them (11 along each axis), and by 2 more where it is moved to; a ray in the mesh's own space by 42 where that is scaled,
// turned and moved (5 along each axis, times a gain of 4.8), and never by more than 208 (24: TOLERABLE_PART in
// scene::bvh). The test of the triangle rounds by what its size is, which is at most the reach twice.
vec3 offset_origin(vec3 position, vec3 geometric_normal, float reach) {
  float size = max(max(abs(position.x), abs(position.y)), abs(position.z));
  float least = max(size, reach);
  float moved = uintBitsToFloat(floatBitsToUint(least) + 256u);
  return position + geometric_normal * (moved - least);
}

#endif
