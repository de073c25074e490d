// How the tables of Wang, Deng and Holzschuch 2020 are looked up.
#ifndef WANG2020_TABLES_GLSL
#define WANG2020_TABLES_GLSL
#include "shared/accumulated_dpf.glsl"

// The normal's frame: along growing polar angle, along growing azimuth, the normal. Directions are those of the
// environment map, whose pole is +Y.
mat3 frame_of_normal(vec3 n) {
  float radius = length(n.xz);
  float sin_phi = radius > 1e-6 ? n.x / radius : 0.0;
  float cos_phi = radius > 1e-6 ? -n.z / radius : 1.0;
  return mat3(vec3(n.y * sin_phi, -radius, -n.y * cos_phi), vec3(cos_phi, 0.0, sin_phi), n);
}

#endif
