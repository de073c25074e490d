// What every glint method is told of a pixel's surface.
#ifndef GLINT_SURFACE_GLSL
#define GLINT_SURFACE_GLSL
#include "shared/frame.glsl"
#include "shared/gbuffer.glsl"
#include "shared/lights.glsl"
#include "shared/materials.glsl"

layout(binding = 30) uniform texture2D uv;
layout(binding = 31) uniform texture2D footprint;
layout(binding = 32) uniform texture2D specular;
layout(binding = 33) uniform utexture2D shadow_mask;

struct GlintSurface {
  uvec2 pixel; // Column and row.
  vec3 position; // In scene space.
  vec3 normal; // Shading normal.
  vec3 o; // Unit, towards the viewer.
  vec2 uv; // Texture coordinates of the flakes.
  vec2 uv_dx; // Their change from pixel to pixel along x,
  vec2 uv_dy; // and along y: the sides of the footprint, a parallelogram about `uv`.
  vec3 f0; // Reflectance of a flake at normal incidence.
  uint shadowed; // One bit for each light that does not reach it.
};

GlintSurface glint_surface(uvec2 pixel, Seen seen) {
  ivec2 at = ivec2(pixel);
  GlintSurface surface;
  surface.pixel = pixel;
  surface.position = seen.position;
  surface.normal = seen.normal;
  surface.o = -normalize(camera_ray(pixel));
  surface.uv = texelFetch(uv, at, 0).xy;
  vec4 sides = texelFetch(footprint, at, 0);
  surface.uv_dx = sides.xy;
  surface.uv_dy = sides.zw;
  surface.f0 = texelFetch(specular, at, 0).rgb;
  surface.shadowed = SHADOWS && light_count() > 0u ? texelFetch(shadow_mask, at, 0).x : 0u;
  return surface;
}

#endif
