// Materials, their textures, and the vertex attributes that only shading needs.
#ifndef MATERIALS_GLSL
#define MATERIALS_GLSL
#extension GL_EXT_samplerless_texture_functions : require
#include "shared/scene.glsl"

struct TextureUse {
  vec3 row_u; // First row of the 2x3 transform of texture coordinates.
  uint texture; // Index into `textures`.
  vec3 row_v; // Second row.
  uint slot_and_set; // TEXTURE_* shifted by one, and the set of texture coordinates: 0 or 1.
};

struct Material {
  vec4 base_color; // Linear colour and coverage.
  vec4 emissive; // Radiance; w: scale of the normal map.
  vec4 surface; // Metalness, perceptual roughness, strength of the occlusion map, alpha cutoff.
  vec4 dielectric; // Reflectance at normal incidence where it is no metal; w: weight of that lobe.
  vec4 coat; // Weight and perceptual roughness of the clear coat.
  vec4 glint_color; // Reflectance of a flake at normal incidence; w: scale of texture coordinates.
  uint flags; // MATERIAL_*.
  uint texture_count; // How many textures it has.
  uint glint_uv_set; // Which set of texture coordinates the flakes lie in.
  uint glint_list; // Its list of tiles plus 1; 0 where it does not glint.
  TextureUse textures[9]; // In the order of their slots.
};

struct TextureRecord {
  uint layer; // Layer of the atlas.
  uint x; // Left edge of level 0.
  uint y; // Top edge of level 0.
  uint width; // Texels of level 0 along x.
  uint height; // Texels of level 0 along y.
  uint mips; // Levels.
  uint wrap; // Two bits an axis: 0 repeat, 1 mirror, 2 clamp.
  uint flags; // TEXTURE_SRGB, TEXTURE_NEAREST.
};

layout(std430, binding = 4) readonly buffer Materials { Material materials[]; };
layout(std430, binding = 5) readonly buffer Uvs { vec4 uvs[]; }; // Two sets of texture coordinates.
layout(std430, binding = 15) readonly buffer Colors { vec4 colors[]; }; // Vertex colours, linear.
layout(std430, binding = 6) readonly buffer Textures { TextureRecord textures[]; };
layout(binding = 7) uniform texture2DArray atlas_srgb;
layout(binding = 8) uniform texture2DArray atlas_linear;

const uint TEXTURE_SRGB = 1u; // Lies in the sRGB atlas.
const uint TEXTURE_NEAREST = 2u; // Magnified without interpolation.

int wrap_texel(int texel, int size, uint mode) {
  if (mode == 2u) {
    return clamp(texel, 0, size - 1);
  }
  int period = mode == 1u ? 2 * size : size;
  int inside = texel % period;
  inside = inside < 0 ? inside + period : inside;
  return inside < size ? inside : period - 1 - inside;
}

vec4 fetch_texel(TextureRecord record, ivec2 texel, ivec2 origin, ivec2 size) {
  ivec2 wrapped = ivec2(
    wrap_texel(texel.x, size.x, record.wrap & 3u),
    wrap_texel(texel.y, size.y, (record.wrap >> 2) & 3u)
  );
  ivec3 at = ivec3(origin + wrapped, int(record.layer));
  return (record.flags & TEXTURE_SRGB) != 0u ? texelFetch(atlas_srgb, at, 0) : texelFetch(atlas_linear, at, 0);
}

// The levels below the first stand in a column at the right of it, from the top.
vec4 sample_level(TextureRecord record, vec2 uv, int level) {
  ivec2 full = ivec2(record.width, record.height);
  ivec2 size = max(full >> level, ivec2(1));
  ivec2 origin = ivec2(record.x, record.y);
  if (level > 0) {
    origin.x += full.x;
    for (int above = 1; above < level; ++above) {
      origin.y += max(full.y >> above, 1);
    }
  }
  vec2 at = uv * vec2(size) - 0.5;
  if ((record.flags & TEXTURE_NEAREST) != 0u) {
    return fetch_texel(record, ivec2(floor(at + 0.5)), origin, size);
  }
  vec2 base = floor(at);
  vec2 part = at - base;
  ivec2 texel = ivec2(base);
  vec4 top = mix(fetch_texel(record, texel, origin, size), fetch_texel(record, texel + ivec2(1, 0), origin, size), part.x);
  vec4 bottom = mix(
    fetch_texel(record, texel + ivec2(0, 1), origin, size),
    fetch_texel(record, texel + ivec2(1, 1), origin, size),
    part.x
  );
  return mix(top, bottom, part.y);
}

// Texture coordinates of the same texel near zero, where a float tells texels apart, along the axes on which the
// texture repeats: mirrored or not, it does so after 2.
vec2 near_zero(TextureRecord record, vec2 at) {
  bvec2 ends = equal(uvec2(record.wrap, record.wrap >> 2) & 3u, uvec2(2u));
  return mix(at - 2.0 * floor(0.5 * at), at, ends);
}

// Texture coordinates through the transform of a use of a texture.
vec2 transformed(TextureUse use_of, vec2 uv) {
  return vec2(dot(use_of.row_u, vec3(uv, 1.0)), dot(use_of.row_v, vec3(uv, 1.0)));
}

// A change of texture coordinates through that transform.
vec2 transformed_change(TextureUse use_of, vec2 change) {
  return vec2(dot(use_of.row_u.xy, change), dot(use_of.row_v.xy, change));
}

// A texture at `uv`, filtered over the footprint spanned by the two derivatives per pixel.
vec4 sample_texture(TextureUse use_of, vec2 uv, vec2 ddx, vec2 ddy) {
  TextureRecord record = textures[use_of.texture];
  vec2 size = vec2(record.width, record.height);
  vec2 along_x = transformed_change(use_of, ddx) * size;
  vec2 along_y = transformed_change(use_of, ddy) * size;
  float texels = sqrt(max(dot(along_x, along_x), dot(along_y, along_y)));
  float lod = clamp(log2(max(texels, 1e-8)), 0.0, float(record.mips - 1u));
  int level = int(lod);
  int next = min(level + 1, int(record.mips) - 1);
  // Within the range of an integer, whatever is clamped there.
  vec2 here = clamp(near_zero(record, transformed(use_of, uv)), vec2(-4.0), vec2(4.0));
  vec4 fine = sample_level(record, here, level);
  return next == level ? fine : mix(fine, sample_level(record, here, next), lod - float(level));
}

#endif
