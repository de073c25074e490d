// The radiance that one material's flakes send to each pixel, by the method that is included.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/glint_surface.glsl"
#include "shared/tile_lists.glsl"
#include "method.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 40, rgba32f) uniform writeonly image2D glints;

void main() {
  uvec2 pixel;
  if (!listed_pixel(materials[material].glint_list - 1u, pixel)) {
    return;
  }
  Seen seen = seen_at(pixel);
  if (seen.instance == 0u || instances[seen.instance - 1u].material != material) {
    return;
  }
  vec3 radiance = glint_radiance(glint_surface(pixel, seen));
  imageStore(glints, ivec2(pixel), vec4(radiance, 1.0));
}
