// Where a triangle is surface and where its material cuts a hole into it, for rays and for the camera alike.
#ifndef ALPHA_MASK_GLSL
#define ALPHA_MASK_GLSL
#include "shared/effects.glsl"
#include "shared/materials.glsl"

// The alpha of a texture within a triangle: at texture coordinates `corner` and a change from there. The finest level,
// so that holes stay where the artist drew them. The corner is brought near zero before the change is added: where a
// texture tiles far from zero, coordinates interpolated first have too few bits left to tell its texels apart.
float finest_alpha(TextureUse use_of, vec2 corner, vec2 change) {
  TextureRecord record = textures[use_of.texture];
  vec2 here = near_zero(record, transformed(use_of, corner)) + transformed_change(use_of, change);
  return sample_level(record, clamp(near_zero(record, here), vec2(-4.0), vec2(4.0)), 0).a;
}

// Whether there is surface at a point of a triangle: everywhere, unless its material has holes. Those are where alpha,
// of the base colour, of its texture and of the vertices, is below the cutoff. An alpha that is NaN cuts nothing.
bool is_covered(uint instance_index, uint triangle, vec2 barycentrics) {
  Instance instance = instances[instance_index];
  bool covered = true;
  // Loops, as some drivers execute branches always, and few triangles have holes.
  uint masks = ALPHA_MASKS && (materials[instance.material].flags & MATERIAL_ALPHA_MASK) != 0u ? 1u : 0u;
  for (uint mask = 0u; mask < masks; ++mask) {
    uvec3 vertices = triangle_vertices(instance, triangle);
    // Rounding may leave the triangle by a hair, and another tile of its texture begin there.
    vec2 weights = clamp(barycentrics, 0.0, 1.0);
    float alpha = materials[instance.material].base_color.a;
    if (VERTEX_COLORS && (instance.flags & INSTANCE_HAS_COLORS) != 0u) {
      // What is the same at all corners stays so to the bit: a cutoff of 1 keeps what is opaque.
      float corner = colors[vertices.x].a;
      float tint = corner + weights.x * (colors[vertices.y].a - corner) + weights.y * (colors[vertices.z].a - corner);
      alpha *= clamp(tint, 0.0, 1.0);
    }
    // The base colour is the first of the textures, if it is there.
    TextureUse use_of = materials[instance.material].textures[0];
    bool textured = TEXTURES && materials[instance.material].texture_count > 0u && use_of.slot_and_set >> 1 == TEXTURE_BASE_COLOR;
    for (uint once = 0u; once < (textured ? 1u : 0u); ++once) {
      vec4 corner = vec4(0.0);
      vec4 change = vec4(0.0);
      if ((instance.flags & INSTANCE_HAS_UV) != 0u) {
        corner = uvs[vertices.x];
        change = weights.x * (uvs[vertices.y] - corner) + weights.y * (uvs[vertices.z] - corner);
      }
      bool second = (use_of.slot_and_set & 1u) != 0u;
      alpha *= finest_alpha(use_of, second ? corner.zw : corner.xy, second ? change.zw : change.xy);
    }
    covered = !(alpha < materials[instance.material].surface.w);
  }
  return covered;
}

#endif
