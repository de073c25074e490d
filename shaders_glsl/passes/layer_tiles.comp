// A list of tiles for each layer of glints: the tiles that show it, and where it is blurred those around them.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#define TILE_LISTS_ARE_WRITTEN
#include "shared/tile_lists.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 30) uniform utexture2D tile_layers; // A bit for each layer.
layout(push_constant) uniform Params {
  uint first_list; // The list of layer 0.
  uint layer_count; // Layers.
  uint blurred_layers; // A bit for each layer that is blurred.
};

void main() {
  ivec2 tile = ivec2(gl_GlobalInvocationID.xy);
  ivec2 last = ivec2(frame_tiles()) - 1;
  if (any(greaterThan(tile, last))) {
    return;
  }
  uint around = 0u;
  for (int neighbour = 0; neighbour < 9; ++neighbour) {
    ivec2 at = clamp(tile + ivec2(neighbour % 3, neighbour / 3) - 1, ivec2(0), last);
    around |= texelFetch(tile_layers, at, 0).x;
  }
  uint shown = texelFetch(tile_layers, tile, 0).x | (around & blurred_layers);
  for (uint layer = 0u; layer < layer_count; ++layer) {
    if ((shown >> layer & 1u) != 0u) {
      append_tile(first_list + layer, uvec2(tile));
    }
  }
}
