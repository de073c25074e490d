// What an alpha mask cuts out of a triangle.
#ifndef ALPHA_MASK_GLSL
#define ALPHA_MASK_GLSL
#include "shared/materials.glsl"

// Whether there is surface at a point of a triangle: everywhere, unless its material has an alpha mask.
bool is_covered(uint instance_index, uint triangle, vec2 barycentrics) {
  Instance instance = instances[instance_index];
  Material material = materials[instance.material];
  bool masked = (material.flags & MATERIAL_ALPHA_MASK) != 0u;
  // A loop, as some drivers execute branches always.
  for (uint once = 0u; once < (masked ? 1u : 0u); ++once) {
    uvec3 vertices = triangle_vertices(instance, triangle);
    vec3 weights = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
    float alpha = material.base_color.a;
    if ((instance.flags & INSTANCE_HAS_COLORS) != 0u) {
      alpha *= dot(weights, vec3(colors[vertices.x].a, colors[vertices.y].a, colors[vertices.z].a));
    }
    // The base colour is the first of the textures, if it is there.
    bool textured = material.texture_count > 0u && material.textures[0].slot_and_set >> 1 == TEXTURE_BASE_COLOR;
    for (uint index = 0u; index < (textured ? 1u : 0u); ++index) {
      vec4 both = vec4(0.0);
      if ((instance.flags & INSTANCE_HAS_UV) != 0u) {
        both = weights.x * uvs[vertices.x] + weights.y * uvs[vertices.y] + weights.z * uvs[vertices.z];
      }
      vec2 uv = (material.textures[index].slot_and_set & 1u) == 0u ? both.xy : both.zw;
      // The finest level: holes stay where the artist drew them.
      alpha *= sample_texture(material.textures[index], uv, vec2(0.0), vec2(0.0)).a;
    }
    masked = alpha < material.surface.w;
    break;
  }
  return !masked;
}

#endif
