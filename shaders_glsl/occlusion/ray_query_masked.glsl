// As ray_query.glsl, in scenes where alpha masks cut holes into triangles.
#define MASKED
#include "occlusion/ray_query.glsl"
