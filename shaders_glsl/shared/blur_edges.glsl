// What blurs may take to lie beyond the border of a picture, other than the picture itself: each gains or loses light there.
#ifndef BLUR_EDGES_GLSL
#define BLUR_EDGES_GLSL

const uint EDGE_BLACK = 0u;
const uint EDGE_REPEATED = 1u;
const uint EDGE_LEFT_OUT = 2u; // The weights that are left are scaled up.

#endif
