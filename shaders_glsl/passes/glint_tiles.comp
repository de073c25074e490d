// Which tiles show which glinting material: a list of tiles for each, and for each tile the layers of glints that it shows.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#define TILE_LISTS_ARE_WRITTEN
#include "shared/materials.glsl"
#include "shared/tile_lists.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 12) uniform utexture2D ids;
layout(binding = 40, r32ui) uniform writeonly uimage2D tile_layers; // A bit for each layer.
layout(push_constant) uniform Params {
  uint material_lists; // Lists of materials: one for each that glints.
};

const uint WORDS = 32u;

shared uint seen[WORDS]; // A bit for each list; those beyond share the last one, as a list may hold more tiles than needed.
shared uint layers;

uint bit_of(uint list) {
  return min(list, 32u * WORDS - 1u);
}

void main() {
  uint at = gl_LocalInvocationIndex;
  if (at < WORDS) {
    seen[at] = 0u;
  }
  if (at == 0u) {
    layers = 0u;
  }
  barrier();
  uvec2 pixel = gl_GlobalInvocationID.xy;
  uint instance = outside_frame(pixel) ? 0u : texelFetch(ids, ivec2(pixel), 0).x;
  uint material = instance == 0u ? 0u : instances[instance - 1u].material;
  if (instance != 0u && materials[material].glint_list != 0u) {
    uint bit = bit_of(materials[material].glint_list - 1u);
    atomicOr(seen[bit / 32u], 1u << (bit % 32u));
    atomicOr(layers, 1u << (materials[material].flags >> MATERIAL_LAYER_SHIFT));
  }
  barrier();
  for (uint list = at; list < material_lists; list += gl_WorkGroupSize.x * gl_WorkGroupSize.y) {
    uint bit = bit_of(list);
    if ((seen[bit / 32u] >> (bit % 32u) & 1u) != 0u) {
      append_tile(list, gl_WorkGroupID.xy);
    }
  }
  if (at == 0u) {
    imageStore(tile_layers, ivec2(gl_WorkGroupID.xy), uvec4(layers));
  }
}
