#version 460
#extension GL_GOOGLE_include_directive : require
// Lists the tiles that a layer has marked, and how many groups each slice of the dispatch over them has. The next picture
// finds no mark.
#include "render/gpu/time_slices.shared.h"
#include "render/raster/shading/read_picture.glsl.h"
#include "render/raster/transparency.shared.h"

layout(local_size_x = 64) in;
layout(binding = kBindLayerTileMarks, std430) buffer TileMarks { uint tile_marks[]; };
layout(binding = kBindLayerTiles, std430) writeonly buffer Tiles { uint tiles[]; };
layout(binding = kBindLayerDispatch, std430) buffer Dispatch {
  ListHead tile_list;
  uint tile_slices[];
};

void main() {
  read_picture();
  const uvec2 across = (uvec2(picture.screen.xy) + 7u) / 8u;
  const uint tile = gl_GlobalInvocationID.x;
  if (tile >= across.x * across.y || tile_marks[tile] == 0u) return;
  tile_marks[tile] = 0u;
  const uint at = atomicAdd(tile_list.listed, 1u);
  tiles[at] = listed_tile(tile % across.x, tile / across.x, 0u);
  atomicAdd(tile_slices[kSliceWords * (at / tile_list.slice_groups)], 1u);
}
