// As bvh.glsl, in scenes where alpha masks cut holes into triangles.
#define MASKED
#include "occlusion/bvh.glsl"
