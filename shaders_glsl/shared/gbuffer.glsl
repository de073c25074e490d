// What the surface pass says of each pixel, for the passes after it.
#ifndef GBUFFER_GLSL
#define GBUFFER_GLSL
#include "shared/directions.glsl"
#extension GL_EXT_samplerless_texture_functions : require

layout(binding = 12) uniform utexture2D ids;
layout(binding = 13) uniform texture2D position;
layout(binding = 14) uniform texture2D normal;

// What all shading needs of a pixel; `instance` is 0 where nothing was seen, the instance's index plus 1 elsewhere.
struct Seen {
  uint instance;
  uint triangle; // In the list of the instance's mesh.
  vec3 position; // In scene space.
  vec3 normal; // Shading normal, on the viewer's side.
  vec3 geometric_normal; // Of the triangle, on the viewer's side.
};

Seen seen_at(uvec2 pixel) {
  ivec2 at = ivec2(pixel);
  Seen seen;
  uvec2 id = texelFetch(ids, at, 0).xy;
  seen.instance = id.x;
  seen.triangle = id.y;
  vec4 first = texelFetch(position, at, 0);
  vec4 second = texelFetch(normal, at, 0);
  seen.position = first.xyz;
  seen.normal = second.xyz;
  seen.geometric_normal = direction_from(vec2(first.w, second.w));
  return seen;
}

#endif
