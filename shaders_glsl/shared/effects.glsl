// What a frame may call for. Pipelines are specialised by these constants: where the census of a frame finds no such thing,
// what shaders do about it is not compiled. All of them true is always right, and the same picture.
#ifndef EFFECTS_GLSL
#define EFFECTS_GLSL

layout(constant_id = 0) const bool ENVIRONMENT = true; // Light from everywhere.
layout(constant_id = 1) const bool POINT_LIGHTS = true; // Lights at points.
layout(constant_id = 2) const bool DIRECTIONAL_LIGHTS = true; // Lights at infinity.
layout(constant_id = 3) const bool SPOT_LIGHTS = true; // Lights with a cone.
layout(constant_id = 4) const bool SHADOWS = true; // Lights that something may hide.
layout(constant_id = 5) const bool ALPHA_MASKS = true; // Materials with holes.
layout(constant_id = 6) const bool TEXTURES = true; // Materials with textures.
layout(constant_id = 7) const bool NORMAL_MAPS = true; // Materials with a texture of normals.
layout(constant_id = 8) const bool VERTEX_COLORS = true; // Meshes with colours at their vertices.
layout(constant_id = 9) const bool CLEAR_COAT = true; // Materials under a clear coat.
layout(constant_id = 10) const bool SMOOTH_SPECULAR = true; // Materials that mirror without glints.
layout(constant_id = 11) const bool DIFFUSE = true; // Materials that scatter light below their surface.
layout(constant_id = 12) const bool GLINTS = true; // Materials that glint.

const bool LIGHTS = POINT_LIGHTS || DIRECTIONAL_LIGHTS || SPOT_LIGHTS;

#endif
