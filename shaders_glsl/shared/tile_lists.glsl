// Lists of the tiles on which something glints: what passes over glints are dispatched over, so that they cost what is on screen.
//
// There is a list for each glinting material, and one for each layer that needs another. Each has room for every tile of the
// frame. A pass that fills them defines TILE_LISTS_ARE_WRITTEN.
#ifndef TILE_LISTS_GLSL
#define TILE_LISTS_GLSL
#include "shared/constants.glsl"
#include "shared/frame.glsl"

struct TileList {
  uint groups[3]; // Along x, y and z: arguments of an indirect dispatch of a group a tile.
  uint tiles; // How many tiles it holds.
};

#ifdef TILE_LISTS_ARE_WRITTEN
layout(std430, binding = 38) writeonly buffer ListedTiles { uint listed_tiles[]; };
layout(std430, binding = 39) buffer TileLists { TileList tile_lists[]; };
#else
layout(std430, binding = 38) readonly buffer ListedTiles { uint listed_tiles[]; }; // List after list, each with room for all tiles.
layout(std430, binding = 39) readonly buffer TileLists { TileList tile_lists[]; };
#endif

// Tiles along x and y.
uvec2 frame_tiles() {
  return (uvec2(frame.width, frame.height) + TILE_SIDE - 1u) / TILE_SIDE;
}

#ifdef TILE_LISTS_ARE_WRITTEN
// Adds a tile to a list. Tiles stand in it in any order: each is worked on by itself.
void append_tile(uint list, uvec2 tile) {
  uvec2 all = frame_tiles();
  uint at = atomicAdd(tile_lists[list].tiles, 1u);
  listed_tiles[list * all.x * all.y + at] = tile.y * all.x + tile.x;
  atomicMax(tile_lists[list].groups[0], min(at + 1u, MOST_GROUPS));
  atomicMax(tile_lists[list].groups[1], at / MOST_GROUPS + 1u);
}
#else
// The pixel of this invocation, one of a group a tile; false where it has none.
bool listed_pixel(uint list, out uvec2 pixel) {
  pixel = uvec2(0u);
  uint at = gl_WorkGroupID.y * MOST_GROUPS + gl_WorkGroupID.x;
  if (at >= tile_lists[list].tiles) {
    return false;
  }
  uvec2 all = frame_tiles();
  uint tile = listed_tiles[list * all.x * all.y + at];
  pixel = TILE_SIDE * uvec2(tile % all.x, tile / all.x) + gl_LocalInvocationID.xy;
  return !outside_frame(pixel);
}
#endif

#endif
