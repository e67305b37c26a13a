// Lists of faces by block: face_blocks.shared.h.
#ifndef LOAM_RENDER_RASTER_FACE_BLOCKS_GLSL_H
#define LOAM_RENDER_RASTER_FACE_BLOCKS_GLSL_H
#include "render/raster/face_blocks.shared.h"
#include "render/raster/transparency.shared.h"
#define EDGES_OF_FACES
#include "render/raster/rectangle_edges.glsl.h"

layout(constant_id = kSpecSecondFaces) const bool kSecondFaces = false;
layout(constant_id = kSpecLayerBlocks) const bool kLayerBlocks = false;
layout(binding = kBindBlockCounts, std430) buffer BlockCounts { uint block_counts[]; };
layout(binding = kBindBlockFaces, std430) writeonly buffer BlockFaces { uint block_faces[]; };
layout(binding = kBindFaceHeads, std430) buffer Heads { uint heads[]; };
layout(binding = kBindActiveBlocks, std430) writeonly buffer Active { uint active_blocks[]; };

uvec2 blocks_across() { return (uvec2(picture.screen.xy) + kBlockPixels - 1u) / kBlockPixels; }

/// Takes a place of a list; some: of its elements make a group of the dispatch over it.
uint take_place(uint head, uint some) {
  const uint place = atomicAdd(heads[head + 3u], 1u);
  atomicMax(heads[head], min(place / some + 1u, kMostGroups));
  return place;
}

void list_in_block(uvec2 block, uint face, uint room) {
  const uint at = block.y * blocks_across().x + block.x, place = atomicAdd(block_counts[at], 1u);
  if (place < room)
    block_faces[at * room + place] = face;
  else
    atomicMax(heads[kLongestHead + 3u], place + 1u);
  if ((kSecondFaces || kLayerBlocks) && place == 0u)
    active_blocks[take_place(kActiveHead, kBlocksInGroup)] = block.x | block.y << 16;
}

/// Whether pixels of a square may lie within the edges: the corner that is farthest within of each does. Sums are made
/// in the order in which those of a pixel are, so that rounding turns no pixel away.
bool may_touch(const RectangleEdges edges, vec2 first_middle, float side) {
  const vec4 x = mix(vec4(first_middle.x), vec4(first_middle.x + side - 1.0), greaterThan(edges.step_x, vec4(0)));
  const vec4 y = mix(vec4(first_middle.y), vec4(first_middle.y + side - 1.0), greaterThan(edges.step_y, vec4(0)));
  precise const vec4 most = edges.constant + x * edges.step_x + y * edges.step_y;
  return all(greaterThanEqual(most, vec4(0)));
}

#endif
