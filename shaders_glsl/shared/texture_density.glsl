// How densely texture space covers the surface that a pixel sees, for methods whose sparkles lie in space and not in texture.
#ifndef TEXTURE_DENSITY_GLSL
#define TEXTURE_DENSITY_GLSL
#include "shared/footprint_area.glsl"
#include "shared/glint_surface.glsl"

// Squares of texture on a square metre of surface: the pixel's area in texture space over that on the surface.
float texture_density(GlintSurface surface) {
  // Rays reach 1 along the camera's axis, the direction of `axis`, before they are normalised.
  vec3 axis = cross(frame.ray_dx.xyz, frame.ray_dy.xyz);
  float axis_length = max(length(axis), 1e-30);
  float towards = abs(dot(axis, surface.o)) / axis_length;
  float depth = length(surface.position - frame.eye.xyz) * towards;
  float surface_area = axis_length * depth * depth * towards / max(dot(surface.o, surface.normal), 1e-3);
  float texture_area = footprint_area(surface.uv_dx, surface.uv_dy);
  return min(texture_area / max(surface_area, 1e-30), 1e20);
}

#endif
