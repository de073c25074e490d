// Where a ray that leaves a surface starts, so that it does not meet the surface it left.
#ifndef RAY_OFFSET_GLSL
#define RAY_OFFSET_GLSL

// Moves a point along the normal by 2^-16 of its largest coordinate: 256 of that coordinate's units in the last place, as
// Waechter and Binder 2019 ("A Fast and Robust Method for Avoiding Self-Intersection") found enough. The largest, where
// they take each by its own: a point on a tilted triangle is as uncertain in its small coordinates as in its large ones.
vec3 offset_origin(vec3 position, vec3 geometric_normal) {
  float size = max(max(abs(position.x), abs(position.y)), abs(position.z));
  return position + geometric_normal * (max(size, 1.0 / 32.0) * (1.0 / 65536.0));
}

#endif
