// A pyramid of the first two moments of radiance over the sphere: equirectangular levels in one buffer, each half as large
// as the one before, down to 4 x 2 texels.
#ifndef MOMENT_LEVELS_GLSL
#define MOMENT_LEVELS_GLSL

const uint MOMENTS_WIDTH = 512u; // Texels along the horizon of the finest level; half as many from pole to pole.
const uint MOMENTS_LEVELS = 8u; // Levels.

// Of the radiance over a texel.
struct TexelMoments {
  vec4 first; // Mean.
  vec4 second; // Mean square, channel by channel.
};

// Where a level begins. Each has a quarter of the texels of the one before.
uint level_begin(uint level) {
  uint finest = MOMENTS_WIDTH * MOMENTS_WIDTH / 2u;
  return (finest - (finest >> (2u * level))) / 3u * 4u;
}

uvec2 level_size(uint level) {
  return uvec2(MOMENTS_WIDTH, MOMENTS_WIDTH / 2u) >> level;
}

#endif
