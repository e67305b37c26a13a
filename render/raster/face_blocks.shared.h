// Faces of cubes rasterized by dispatches: lists of faces for each block of 8 x 8 pixels, and a walk over each list
// that keeps the nearest face of each pixel. A pipeline sets triangles up on one thread of a processor; dispatches take
// all.
//
//   setup   an invocation a face: its edges and depth, linear over the screen. A small face is listed in its blocks;
//           another becomes items, one for each bin of 8 x 8 blocks that it may touch
//   spread  eight invocations an item, each a column of the bin's blocks: lists it where it touches the block
//   blocks  eight invocations a block, each a row of its pixels
//
// Which order a list has shows in no picture: of two faces at the same depth that with the larger number is seen.
//
// source  Samuli Laine, Tero Karras. High-Performance Software Rasterization on GPUs. 2011 (bins, then tiles)
#ifndef LOAM_RENDER_RASTER_FACE_BLOCKS_SHARED_H
#define LOAM_RENDER_RASTER_FACE_BLOCKS_SHARED_H

#include "render/raster/raster.shared.h"

#ifdef __cplusplus
namespace render::raster {
#endif

SHARED_CONST uint kBlockPixels = kTilePixels;  // a block's side: it is a tile of the occlusion test
SHARED_CONST uint kBinBlocks = 8u;             // a bin's side
SHARED_CONST uint kSmallBlocks = 6u;           // a face is small that touches no more

/// A set-up face, what a pixel reads of it: as seen_image, the chunk's detail with the bits of edges whose line is
/// within (rectangle_edges.glsl.h), the offset of its plane; its rectangle. Edges and depth are made of them anew for
/// each block: software reads two texels and works these out faster than it reads five.
SHARED_CONST uint kSetupTexels = 2u;

/// A head of a list: the groups of a dispatch over it, along x, y, z, and how long it is. Of items of the first pass,
/// of the second; of active blocks of the second; of the longest list of a block (its last word alone); then, page by
/// page, of faces that the second pass draws.
SHARED_CONST uint kHeadWords = 4u;
SHARED_CONST uint kItemsHead = 0u, kSecondItemsHead = 4u, kActiveHead = 8u, kLongestHead = 12u, kPageHeads = 16u;
SHARED_CONST uint kMostGroups = 65535u;  // along x, which every device has
SHARED_CONST uint kSetupGroup = 64u;
SHARED_CONST uint kMostListed = 1u << 21;  // faces of a pass: fewer than kMostGroups of setup, and 64 MiB of them
SHARED_CONST uint kBlocksInGroup = 8u, kItemsInGroup = 8u;
SHARED_CONST uint kGroupsInRun = 4u;  // which are walked one after the other, as neighbours share faces

/// What setup is told.
struct SetupRange {
  uint first_listed, count;     // in the list of faces
  uint first_face;              // number of the first
  uint page;                    // of the second pass: count and number are in the heads of the pages
  uint faces, items, of_block;  // room for them, and for those of a block
};

#ifdef __cplusplus
}  // namespace render::raster
#endif
#endif
