// Blurs the visibility of the mirror direction along one axis (Wang, Deng and Holzschuch 2020, section 5.3).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/frame.glsl"
#include "shared/blur.glsl"
#include "shared/tile_lists.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 30) uniform texture2D source;
layout(binding = 40, r32f) uniform writeonly image2D blurred_image;
layout(push_constant) uniform Params {
  ivec2 axis; // (1, 0) or (0, 1).
  int radius; // Taps on each side of the centre.
  uint list; // Of the tiles that are blurred.
  float weights[5]; // Of the centre and of the taps on each side.
};

void main() {
  uvec2 pixel;
  if (!listed_pixel(list, pixel)) {
    return;
  }
  ivec2 at = ivec2(pixel);
  ivec2 size = ivec2(frame.width, frame.height);
  imageStore(blurred_image, at, blurred(source, at, size, axis, radius, weights));
}
