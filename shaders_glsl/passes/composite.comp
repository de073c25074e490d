// Adds a layer of glints, dimmed where their mirror direction is occluded, to everything else.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/frame.glsl"
#include "shared/microfacet.glsl"
#include "shared/gbuffer.glsl"
#include "shared/tile_lists.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 31) uniform texture2D glints;
layout(binding = 32) uniform texture2D visibility;
layout(binding = 33) uniform texture2D uv;
layout(binding = 40, rgba32f) uniform image2D radiance;
layout(push_constant) uniform Params {
  uint list; // Of the tiles that the layer reaches.
  uint occluded; // 1: `visibility` holds the visibility of the mirror direction.
};

void main() {
  uvec2 pixel;
  if (!listed_pixel(list, pixel)) {
    return;
  }
  ivec2 at = ivec2(pixel);
  vec4 color = imageLoad(radiance, at);
  vec3 glint = texelFetch(glints, at, 0).rgb;
  if (occluded == 1u) {
    glint *= texelFetch(visibility, at, 0).r;
  }
  Seen seen = seen_at(pixel);
  if (CLEAR_COAT && seen.instance != 0u) {
    // What the clear coat reflects does not reach the flakes below it.
    float coat = texelFetch(uv, at, 0).z;
    float o_n = clamp(dot(seen.normal, -normalize(camera_ray(pixel))), 0.0, 1.0);
    glint *= 1.0 - coat * schlick(vec3(0.04), o_n).x;
  }
  imageStore(radiance, at, vec4(color.rgb + glint, color.a));
}
