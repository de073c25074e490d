// Where a ray that leaves a surface starts, so that it does not meet the surface it left.
#ifndef RAY_OFFSET_GLSL
#define RAY_OFFSET_GLSL

// Moves a point along the normal by 256 units in the last place of its largest coordinate, as Waechter and Binder 2019
// ("A Fast and Robust Method for Avoiding Self-Intersection") found enough. The largest, where they take each by its
// own: a point on a tilted triangle is as uncertain in its small coordinates as in its large ones. Near the origin the
// distance stays what it is at 1/4 of `scene_unit`, the power of two that the scene fits into: a point there may come from
// corners, and from the origin of its mesh, that are as far out as the scene goes.
//
// So the way is 2^-17 to 2^-15 of the scene's size, 0.008 to 0.03 mm in a scene of 1 m. Roundings of the point and of the
// ray in the mesh's own space stay below 2^-17 where that space loses no more than TOLERABLE_GAIN in scene::bvh admits.
vec3 offset_origin(vec3 position, vec3 geometric_normal, float scene_unit) {
  float size = max(max(abs(position.x), abs(position.y)), abs(position.z));
  float least = max(size, scene_unit * 0.25);
  float moved = uintBitsToFloat(floatBitsToUint(least) + 256u);
  return position + geometric_normal * (moved - least);
}

#endif
