// The camera and the frame. Scene space is world space about the scene's centre.
#ifndef FRAME_GLSL
#define FRAME_GLSL
#include "shared/effects.glsl"

layout(std140, binding = 0) uniform Frame {
  mat4 clip_from_scene; // Reversed depth: 1 at the near plane, 0 at infinity.
  vec4 eye; // Camera position in scene space.
  vec4 ray_corner; // Direction through the corner of pixel (0, 0).
  vec4 ray_dx; // Change of direction for one pixel to the right.
  vec4 ray_dy; // Change of direction for one pixel down.
  vec4 environment; // Cosine and sine of its rotation about +Y, its scale, unused.
  uint width; // Pixels along x.
  uint height; // Pixels along y.
  uint light_count; // Lights in the scene.
  uint has_environment; // 1 where there is an environment.
  uint sample_index; // Which sample of its pixels this frame is: methods that draw directions draw others in each.
  float span; // Side of the part of its pixel that a sample stands for, in pixels: 1, or less where a pixel is taken apart.
} frame;

// Direction, not normalised, of the ray through the centre of a pixel.
vec3 camera_ray(uvec2 pixel) {
  vec2 center = vec2(pixel) + 0.5;
  return frame.ray_corner.xyz + center.x * frame.ray_dx.xyz + center.y * frame.ray_dy.xyz;
}

// Lights in the scene, where there are any.
uint light_count() {
  return LIGHTS ? frame.light_count : 0u;
}

// Whether there is an environment.
bool has_environment() {
  return ENVIRONMENT && frame.has_environment == 1u;
}

bool outside_frame(uvec2 pixel) {
  return pixel.x >= frame.width || pixel.y >= frame.height;
}

#endif
