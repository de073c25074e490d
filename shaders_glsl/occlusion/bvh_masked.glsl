// As bvh.glsl, in scenes where alpha masks cut holes into triangles.
#define ALPHA_MASKS
#include "occlusion/bvh.glsl"
